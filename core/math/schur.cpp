#include "core/math/schur.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <dlfcn.h>
#include <lapacke.h>

#include <algorithm>
#include <limits>
#include <string>

namespace consort {

namespace {

// A function of LAPACKE. The library is loaded when the first of them is needed: most agents never need one, and loading it at their start
// would cost each of a thousand 5 ms and 3 MB.
template <class Function>
Function* lapacke(const char* name) {
  static void* const library = dlopen("liblapacke.so.3", RTLD_NOW | RTLD_LOCAL);
  void* const symbol = library == nullptr ? nullptr : dlsym(library, name);
  if (symbol == nullptr) throw RunError(std::string(name) + ": " + dlerror() + "; is the package liblapacke installed?");
  return reinterpret_cast<Function*>(symbol);
}

lapack_logical is_stable(const double* real, const double* /*imaginary*/) { return *real < 0.0 ? 1 : 0; }

RealSchur schur(const Matrix& A, bool stable_first) {
  check(A.rows() == A.cols(), "real_schur: the matrix is square");
  const auto n = static_cast<lapack_int>(A.rows());
  RealSchur form{Matrix(n, n), A, {}};
  if (n == 0) return form;
  Vector real(n), imaginary(n);
  lapack_int stable = 0;
  static auto* const dgees = lapacke<decltype(LAPACKE_dgees)>("LAPACKE_dgees");
  const lapack_int info = dgees(LAPACK_COL_MAJOR, 'V', stable_first ? 'S' : 'N', stable_first ? is_stable : nullptr, n, form.T.data(), n,
                                &stable, real.data(), imaginary.data(), form.U.data(), n);
  // n + 2 only says that an eigenvalue crossed the imaginary axis while it was moved.
  if (info != 0 && info != n + 2)
    throw RunError("Schur form of a " + shape_of(A) +
                   " matrix: " + (info == n + 1 ? "its eigenvalues are too close to be ordered" : "the iteration did not converge") +
                   " (dgees returned " + std::to_string(info) + ")");
  form.eigenvalues.reserve(static_cast<std::size_t>(n));
  for (lapack_int i = 0; i < n; ++i) form.eigenvalues.emplace_back(real(i), imaginary(i));
  return form;
}

}  // namespace

RealSchur real_schur(const Matrix& A) { return schur(A, false); }

RealSchur stable_first_schur(const Matrix& A) { return schur(A, true); }

Vector balancing(const Matrix& A) {
  check(A.rows() == A.cols() && A.rows() > 0, "balancing: the matrix is square and not empty");
  const auto n = static_cast<lapack_int>(A.rows());
  Matrix balanced = A;
  Vector scale(n);
  lapack_int first = 0, last = 0;
  static auto* const dgebal = lapacke<decltype(LAPACKE_dgebal)>("LAPACKE_dgebal");
  const lapack_int info = dgebal(LAPACK_COL_MAJOR, 'S', n, balanced.data(), n, &first, &last, scale.data());
  if (info != 0) throw RunError("balancing of a " + shape_of(A) + " matrix: dgebal returned " + std::to_string(info));
  return scale;
}

Matrix solve_quasi_triangular(const Matrix& T, Matrix F) {
  check(T.rows() == T.cols() && F.rows() == T.rows() && F.cols() == T.rows(), "solve_quasi_triangular: both matrices are n x n");
  const auto n = static_cast<lapack_int>(T.rows());
  double scale = 1.0;
  // Returns 1 after having moved eigenvalues apart that sum to zero; the caller has excluded that.
  static auto* const dtrsyl = lapacke<decltype(LAPACKE_dtrsyl)>("LAPACKE_dtrsyl");
  const lapack_int info = dtrsyl(LAPACK_COL_MAJOR, 'N', 'T', 1, n, n, T.data(), n, T.data(), n, F.data(), n, &scale);
  if (info < 0) throw RunError("Sylvester equation with a " + shape_of(T) + " matrix: dtrsyl returned " + std::to_string(info));
  return F / scale;
}

std::vector<std::complex<double>> eigenvalues_of(const Matrix& A) { return real_schur(A).eigenvalues; }

double spectral_abscissa(const Matrix& A) {
  check(A.rows() > 0, "spectral_abscissa: the matrix has a row");
  double largest = -std::numeric_limits<double>::infinity();
  for (const std::complex<double> value : eigenvalues_of(A)) largest = std::max(largest, value.real());
  return largest;
}

double spectral_radius(const Matrix& A) {
  double largest = 0.0;
  for (const std::complex<double> value : eigenvalues_of(A)) largest = std::max(largest, std::abs(value));
  return largest;
}

}  // namespace consort
