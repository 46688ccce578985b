#pragma once
/// Which part of x' = A x + B u the inputs reach, and which part of x the outputs y = C x show. A is n x n, B n x m, C p x n.
///
/// Decided by the orthogonal staircase (Paige 1981), not by a rank test at each computed eigenvalue (Hautus): the part that is not
/// reached is split off first, so a defective eigenvalue that both parts share is not mistaken for two near ones. A coupling counts as
/// zero below 1e-12 of ||A|| (Frobenius); columns of B and rows of C are scaled to length one, those below 1e-14 of the longest to zero.
/// All functions throw ConfigError on other shapes and on entries that are not finite.

#include "core/types.hpp"

#include <complex>
#include <optional>

namespace consort {

/// Coordinates z = U' x, U orthogonal (n x n), in which the first `dimension` components are the part that is reached (or seen).
///   reached:  U'AU = [* *; 0 rest],  U'B = [*; 0]
///   seen:     U'AU = [* 0; * rest],  C U = [* 0]
struct Split {
  Matrix U;
  Eigen::Index dimension = 0;
  Matrix rest;  ///< (n - dimension) square: the dynamics of the other part
};
Split controllable_split(const Matrix& A, const Matrix& B);
Split observable_split(const Matrix& A, const Matrix& C);

/// Whether a condition holds; if not, an eigenvalue of A that breaks it (that of largest real part).
struct Verdict {
  std::optional<std::complex<double>> offending;
  explicit operator bool() const { return !offending.has_value(); }
};
Verdict controllable(const Matrix& A, const Matrix& B);  ///< B reaches every mode
Verdict observable(const Matrix& A, const Matrix& C);    ///< C sees every mode

// An eigenvalue counts as on the imaginary axis if its real part is within 1.5e-8 ||rest|| or 1e-12 ||A|| of zero: a double eigenvalue
// is computed no more precisely.
Verdict stabilisable(const Matrix& A, const Matrix& B);            ///< B reaches every mode that does not decay
Verdict detectable(const Matrix& A, const Matrix& C);              ///< C sees every mode that does not decay
Verdict observable_on_the_axis(const Matrix& A, const Matrix& C);  ///< C sees every mode on the imaginary axis

}  // namespace consort
