#pragma once
/// What a computation asks of the matrices a user gives it: shape, finite entries, symmetry, definiteness. Every complaint is a
/// ConfigError that names the matrix (`what`, as in "continuous_riccati: B"), what was found and what is allowed.

#include "core/types.hpp"

#include <complex>
#include <string>
#include <string_view>

namespace consort {

std::string text_of(double value);                ///< six significant digits
std::string text_of(std::complex<double> value);  ///< as "-1 + 2i"; the imaginary part only if there is one
std::string text_of(const Vector& value);         ///< as "(1, 2)"; a single number alone
std::string shape_of(const Matrix& value);        ///< as "2 x 3"

/// Throws ConfigError unless `value` is square, has a row, and has finite entries only.
void require_square(const Matrix& value, std::string_view what);

/// Throws ConfigError unless `value` has `rows` rows, at least one column, and finite entries only.
void require_rows(const Matrix& value, Eigen::Index rows, std::string_view what);

/// Throws ConfigError unless `value` has `cols` columns, at least one row, and finite entries only.
void require_columns(const Matrix& value, Eigen::Index cols, std::string_view what);

enum class Definiteness { any, semidefinite, definite };

/// `value` (n x n), exactly symmetric. Throws ConfigError on another shape, an entry that is not finite, asymmetry beyond 1e-12 of the
/// largest entry, or an eigenvalue that `definiteness` does not allow (up to rounding, 1e-12 n of the largest entry).
Matrix require_symmetric(const Matrix& value, Eigen::Index n, std::string_view what, Definiteness definiteness);

}  // namespace consort
