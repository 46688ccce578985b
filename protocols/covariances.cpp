#include "protocols/covariances.hpp"

#include <algorithm>
#include <cmath>

namespace consort::detail {
namespace {

double power(double e) { return std::ldexp(1.0, static_cast<int>(std::max(e, -3000.0))); }

/// P becomes D P D with D = diag(d_c).
void scale_by(std::span<double> P, std::span<const double> d) {
  std::size_t at = 0;
  for (const double of_column : d)
    for (const double of_row : d) {
      P[at] = of_row * P[at] * of_column;
      ++at;
    }
}

}  // namespace

void scale(std::span<double> P, std::span<const double> e) {
  std::vector<double> d(e.size());
  std::transform(e.begin(), e.end(), d.begin(), power);
  scale_by(P, d);
}

void settle_exponents(std::span<double> P, std::span<double> e) {
  const std::size_t n = e.size();
  const auto wanted = [&](std::size_t c) {
    const double size = std::ilogb(P[c * (n + 1)]) + 2.0 * e[c];
    return size < kLeastExponent ? std::floor(0.5 * size) : 0.0;
  };
  bool settled = true;
  for (std::size_t c = 0; c < n; ++c) settled = settled && e[c] == wanted(c);
  if (settled) return;
  std::vector<double> change(n);
  for (std::size_t c = 0; c < n; ++c) {
    const double to = wanted(c);
    change[c] = e[c] - to;
    e[c] = to;
  }
  scale(P, change);
}

void lower_to(std::span<double> unit, std::span<const double> e, std::span<const double> noise) {
  for (std::size_t c = 0; c < unit.size(); ++c) unit[c] = std::min(unit[c], noise[c * (unit.size() + 1)] > 0.0 ? 0.0 : e[c]);
}

void convert(std::span<double> P, std::span<const double> e, std::span<const double> unit) {
  std::vector<double> d(unit.size());
  for (std::size_t c = 0; c < d.size(); ++c) d[c] = power(std::min(e[c] - unit[c], kFarthestExponent));
  scale_by(P, d);
}

std::vector<double> units_of_x(std::span<const double> unit) {
  std::vector<double> out(unit.size());
  const double largest = unit.empty() ? 0.0 : *std::max_element(unit.begin(), unit.end());
  for (std::size_t c = 0; c < out.size(); ++c) out[c] = power(std::max(unit[c] - largest, -kFarthestExponent));
  return out;
}

void divide(std::span<double> x, std::span<const double> by) {
  for (std::size_t c = 0; c < x.size(); ++c) x[c] = x[c] / by[c];
}

void multiply(std::span<double> x, std::span<const double> by) {
  for (std::size_t c = 0; c < x.size(); ++c) x[c] = x[c] * by[c];
}

}  // namespace consort::detail
