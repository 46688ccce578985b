#include "core/random.hpp"

#include "core/errors.hpp"

#include <cmath>
#include <numbers>

namespace consort {

namespace {
__extension__ using Wide = unsigned __int128;
}

double Stream::uniform(double low, double high) {
  const double value = low + (high - low) * uniform();
  // Rounding may reach the excluded end.
  return value < high || low == high ? value : std::nextafter(high, low);
}

std::uint64_t Stream::below(std::uint64_t n) {
  check(n >= 1, "Stream::below needs n >= 1");
  // Lemire 2019: the high word of bits * n, rejecting the 2^64 mod n low words that would make some values likelier.
  Wide product = static_cast<Wide>(bits()) * n;
  if (static_cast<std::uint64_t>(product) < n) {
    const std::uint64_t threshold = (0 - n) % n;
    while (static_cast<std::uint64_t>(product) < threshold) product = static_cast<Wide>(bits()) * n;
  }
  return static_cast<std::uint64_t>(product >> 64);
}

double Stream::normal() {
  if (has_spare_) {
    has_spare_ = false;
    return spare_normal_;
  }
  // Box, Muller 1958. 1 - u lies in (0, 1], so the logarithm is finite.
  const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
  const double angle = 2.0 * std::numbers::pi * uniform();
  spare_normal_ = radius * std::sin(angle);
  has_spare_ = true;
  return radius * std::cos(angle);
}

}  // namespace consort
