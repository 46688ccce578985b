#pragma once
/// Curves of any number of reported rounds as few points, for eyes: nothing that stands out is lost. Pure.

#include <cstddef>
#include <span>
#include <vector>

namespace consort {

/// Curves over one time axis.
struct Curves {
  std::vector<double> x;               ///< ascending
  std::vector<std::vector<double>> y;  ///< by curve, each as long as x; NaN: nothing is there
  bool thinned = false;                ///< some points are left out
};

/// Keeps of each stretch of reports the smallest and the largest value of every curve, in the order in which they came; the first and the
/// last report are kept as they are. Where there are no more reports than points, all are kept.
class Decimation {
 public:
  /// `reports`: how many will be added; `most`: points of a curve, at least 8.
  Decimation(std::size_t curves, std::size_t reports, std::size_t most);
  void add(double x, std::span<const double> values);
  [[nodiscard]] Curves finish();

 private:
  struct Extremes {
    double smallest, largest;
    bool largest_first;
  };
  void flush();
  void put(double x, std::span<const double> values);

  Curves curves_;
  std::size_t reports_, stretch_;  // reports in a stretch; 1: all are kept
  std::size_t added_ = 0, held_ = 0;
  double from_ = 0.0, to_ = 0.0;
  std::vector<Extremes> extremes_;
  std::vector<double> row_;
};

/// Quantiles of `values` that are not NaN, by linear interpolation between order statistics; all NaN where none is a number. `values` is
/// reordered.
std::vector<double> quantiles(std::vector<double>& values, std::span<const double> shares);

}  // namespace consort
