#pragma once
/// Named numeric values: what parameters and initial conditions are once the experiment has been read.

#include "core/types.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// Expands `given` to a symmetric n x n matrix: a scalar (times identity), an n-vector (diagonal) or n x n.
/// Throws ConfigError naming `name` on any other shape, a non-finite entry, asymmetry, or a negative eigenvalue (zero too if `strictly`).
Matrix expand_covariance(const Matrix& given, Eigen::Index n, std::string_view name, bool strictly = false);

/// A small table name -> matrix. A scalar is 1x1, a vector n x 1. Order of insertion is kept; names are unique.
class Values {
 public:
  struct Entry {
    std::string name;
    Matrix value;
  };

  void set(std::string_view name, Matrix value);  ///< inserts or replaces
  void set(std::string_view name, double value);
  [[nodiscard]] const Matrix* find(std::string_view name) const;  ///< nullptr if absent
  [[nodiscard]] bool has(std::string_view name) const { return find(name) != nullptr; }

  /// The scalar `name`; `fallback` if absent. Throws ConfigError if it is present and not 1x1, or absent without fallback.
  [[nodiscard]] double scalar(std::string_view name, std::optional<double> fallback = {}) const;
  /// The vector `name` (n x 1; a scalar is a vector of length one). Throws ConfigError as above.
  [[nodiscard]] Vector vector(std::string_view name) const;
  /// A symmetric positive (semi)definite n x n matrix given as scalar (times identity), n-vector (diagonal) or n x n matrix.
  /// Throws ConfigError on any other shape, asymmetry, or a negative eigenvalue (zero too if `strictly`).
  [[nodiscard]] Matrix covariance(std::string_view name, Eigen::Index n, std::optional<double> fallback = {}, bool strictly = false) const;

  [[nodiscard]] const std::vector<Entry>& entries() const { return entries_; }
  [[nodiscard]] Values overridden_by(const Values& other) const;  ///< this, with `other`'s entries on top

 private:
  std::vector<Entry> entries_;
};

}  // namespace consort
