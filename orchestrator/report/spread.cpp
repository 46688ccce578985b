#include "orchestrator/report/spread.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace consort {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// Probability of |T| <= t. Source: Abramowitz, Stegun 1964, "Handbook of Mathematical Functions", 26.7.3 (odd) and 26.7.4 (even).
double within(double t, std::size_t freedom) {
  const double angle = std::atan(t / std::sqrt(static_cast<double>(freedom)));
  const double sine = std::sin(angle), square = std::cos(angle) * std::cos(angle);
  const bool odd = freedom % 2 == 1;
  double term = odd ? std::cos(angle) : 1.0, sum = 0.0;
  for (std::size_t k = odd ? 3 : 2; k <= freedom; k += 2) {
    sum += term;
    const auto n = static_cast<double>(k);
    term *= square * (n - 1.0) / n;
  }
  return odd ? 2.0 / std::numbers::pi * (angle + sine * sum) : sine * sum;
}

double quantile(const std::vector<double>& sorted, double share) {
  if (sorted.empty()) return kNone;
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const std::size_t above = std::min(below + 1, sorted.size() - 1);
  const double part = at - static_cast<double>(below);
  return part == 0.0 ? sorted[below] : sorted[below] + part * (sorted[above] - sorted[below]);
}

}  // namespace

double student_t95(std::size_t freedom) {
  if (freedom == 0) return kNone;
  constexpr std::size_t kMostExact = 1000;
  constexpr double kNormal = 1.959963984540054;
  if (freedom > kMostExact) {  // Cornish-Fisher, 26.7.5
    const auto n = static_cast<double>(freedom);
    const double z = kNormal;
    return z + (std::pow(z, 3) + z) / (4 * n) + (5 * std::pow(z, 5) + 16 * std::pow(z, 3) + 3 * z) / (96 * n * n);
  }
  double low = kNormal, high = 13.0;
  for (int step = 0; step < 60; ++step) {
    const double middle = 0.5 * (low + high);
    (within(middle, freedom) < 0.95 ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Spread spread_of(std::span<const double> numbers) {
  std::vector<double> sorted(numbers.begin(), numbers.end());
  std::sort(sorted.begin(), sorted.end());
  Spread out{numbers.size(),
             kNone,
             kNone,
             kNone,
             kNone,
             quantile(sorted, 0.05),
             quantile(sorted, 0.25),
             quantile(sorted, 0.5),
             quantile(sorted, 0.75),
             quantile(sorted, 0.95)};
  if (numbers.empty()) return out;
  const auto count = static_cast<double>(numbers.size());
  double sum = 0.0, squares = 0.0;
  for (const double number : numbers) sum += number;
  out.mean = numbers.size() == 1 ? numbers.front() : sum / count;
  if (numbers.size() < 2) return out;
  for (const double number : numbers) squares += (number - out.mean) * (number - out.mean);
  out.deviation = std::sqrt(squares / (count - 1.0));
  const double half = student_t95(numbers.size() - 1) * out.deviation / std::sqrt(count);
  out.low = out.mean - half;
  out.high = out.mean + half;
  return out;
}

}  // namespace consort
