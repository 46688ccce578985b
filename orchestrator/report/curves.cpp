#include "orchestrator/report/curves.hpp"

#include "core/errors.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace consort {
namespace {
constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
}

Decimation::Decimation(std::size_t curves, std::size_t reports, std::size_t most) : reports_(reports), row_(curves) {
  check(most >= 8, "a curve has at least 8 points");
  curves_.y.resize(curves);
  // Two points a stretch, and one each for the first and the last report.
  const std::size_t stretches = (most - 2) / 2;
  stretch_ = reports <= most ? 1 : (reports - 2 + stretches - 1) / stretches;
  curves_.thinned = stretch_ > 1;
}

void Decimation::put(double x, std::span<const double> values) {
  curves_.x.push_back(x);
  for (std::size_t c = 0; c < values.size(); ++c) curves_.y[c].push_back(values[c]);
}

void Decimation::flush() {
  if (held_ == 0) return;
  for (std::size_t c = 0; c < row_.size(); ++c) row_[c] = extremes_[c].largest_first ? extremes_[c].largest : extremes_[c].smallest;
  put(from_, row_);
  if (held_ > 1) {
    for (std::size_t c = 0; c < row_.size(); ++c) row_[c] = extremes_[c].largest_first ? extremes_[c].smallest : extremes_[c].largest;
    put(to_, row_);
  }
  held_ = 0;
}

void Decimation::add(double x, std::span<const double> values) {
  check(values.size() == row_.size(), "one value for each curve");
  const bool ends = added_ == 0 || added_ + 1 >= reports_;
  ++added_;
  if (stretch_ == 1 || ends) {
    flush();
    put(x, values);
    return;
  }
  if (held_ == 0) {
    from_ = x;
    extremes_.assign(row_.size(), {kNothing, kNothing, false});
  }
  for (std::size_t c = 0; c < values.size(); ++c) {
    Extremes& e = extremes_[c];
    if (std::isnan(values[c])) continue;
    if (std::isnan(e.smallest)) {
      e = {values[c], values[c], false};
    } else if (values[c] < e.smallest) {
      e.smallest = values[c];
      e.largest_first = true;
    } else if (values[c] > e.largest) {
      e.largest = values[c];
      e.largest_first = false;
    }
  }
  to_ = x;
  if (++held_ == stretch_) flush();
}

Curves Decimation::finish() {
  flush();
  return std::move(curves_);
}

std::vector<double> quantiles(std::vector<double>& values, std::span<const double> shares) {
  values.erase(std::remove_if(values.begin(), values.end(), [](double v) { return std::isnan(v); }), values.end());
  std::vector<double> result(shares.size(), kNothing);
  if (values.empty()) return result;
  std::sort(values.begin(), values.end());
  for (std::size_t s = 0; s < shares.size(); ++s) {
    const double place = shares[s] * static_cast<double>(values.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, values.size() - 1);
    result[s] = values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
  }
  return result;
}

}  // namespace consort
