#include "core/riccati.hpp"

#include "core/controllability.hpp"
#include "core/errors.hpp"
#include "core/schur.hpp"
#include "core/shapes.hpp"

#include <cmath>
#include <limits>

namespace consort {

namespace {

constexpr double kLargestResidual = 1e-8;

/// The equation as its user knows it; the filter's is solved as the control equation of (A', C').
struct Wording {
  std::string name;       // of the function
  std::string pair;       // "(A, B) is not stabilisable: B does not reach"
  std::string weighting;  // "Q does not see"
};

struct Terms {
  Matrix A, G, Q;  // A'P + P A - P G P + Q = 0
};

/// Symplectic balancing: x = diag(s)^-1 z leaves the Hamiltonian of z with blocks of comparable size. P of x is diag(s) P_z diag(s).
Vector scaling_of(const Matrix& hamiltonian) {
  const Eigen::Index n = hamiltonian.rows() / 2;
  const Vector powers = balancing(hamiltonian);
  Vector scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale(i) = std::ldexp(1.0, (std::ilogb(powers(n + i)) - std::ilogb(powers(i))) / 2);
  return scale;
}

/// P = U2 U1^-1 from the stable invariant subspace [U1; U2] of the Hamiltonian.
Matrix stabilising_solution(const Terms& terms, const Wording& wording) {
  const Eigen::Index n = terms.A.rows();
  Matrix hamiltonian(2 * n, 2 * n);
  hamiltonian << terms.A, -terms.G, -terms.Q, -terms.A.transpose();
  const Vector scale = scaling_of(hamiltonian);
  Vector both(2 * n);
  both << scale, scale.cwiseInverse();
  const RealSchur schur = stable_first_schur(both.asDiagonal() * hamiltonian * both.cwiseInverse().asDiagonal());
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    const std::complex<double> value = schur.eigenvalues[static_cast<std::size_t>(i)];
    if ((value.real() < 0.0) != (i < n))
      throw ConfigError(wording.name + ": the Hamiltonian (" + shape_of(hamiltonian) + ") has the eigenvalue " + text_of(value) +
                        " on the imaginary axis within rounding: the loop can be stabilised, or its cost seen, only just");
  }
  const Eigen::PartialPivLU<Matrix> factor(schur.U.topLeftCorner(n, n).transpose());
  if (const double reciprocal = factor.rcond(); !(reciprocal > std::numeric_limits<double>::epsilon()))
    throw RunError(wording.name + ": the leading block (" + shape_of(terms.A) + ") of the stable subspace is singular, condition " +
                   text_of(1.0 / reciprocal));
  const Matrix P = factor.solve(schur.U.bottomLeftCorner(n, n).transpose());
  return scale.asDiagonal() * (0.5 * (P + P.transpose())) * scale.asDiagonal();
}

double residual_of(const Terms& terms, const Matrix& P) {
  const Matrix linear = P * terms.A, quadratic = P * terms.G * P;
  const double size = 2.0 * linear.norm() + quadratic.norm() + terms.Q.norm();
  return size == 0.0 ? 0.0 : (linear + linear.transpose() - quadratic + terms.Q).norm() / size;
}

/// `A`, `B` with shapes already checked.
RiccatiSolution solve(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R, const Wording& wording) {
  const Matrix weight = require_symmetric(R, B.cols(), wording.name + ": R", Definiteness::definite);
  Terms terms{A, {}, require_symmetric(Q, A.rows(), wording.name + ": Q", Definiteness::semidefinite)};
  if (const Verdict verdict = stabilisable(A, B); !verdict)
    throw ConfigError(wording.name + ": " + wording.pair + " the eigenvalue " + text_of(*verdict.offending) + " of A");
  if (const Verdict verdict = observable_on_the_axis(A, terms.Q); !verdict)
    throw ConfigError(wording.name + ": (A, Q) leaves an eigenvalue on the imaginary axis: " + wording.weighting + " the eigenvalue " +
                      text_of(*verdict.offending) + " of A");
  const Eigen::LLT<Matrix> factor(weight);
  const Matrix half = factor.matrixL().solve(B.transpose());  // G = B R^-1 B' comes out exactly symmetric
  terms.G = half.transpose() * half;
  RiccatiSolution solution;
  solution.P = stabilising_solution(terms, wording);
  solution.K = factor.solve(B.transpose() * solution.P);
  solution.abscissa = spectral_abscissa(A - B * solution.K);
  solution.residual = residual_of(terms, solution.P);
  if (!(solution.residual <= kLargestResidual && solution.abscissa < 0.0))
    throw RunError(wording.name + ": rounding spoils the solution for A (" + shape_of(A) + "): residual " + text_of(solution.residual) +
                   ", largest real part of the loop " + text_of(solution.abscissa));
  return solution;
}

}  // namespace

RiccatiSolution continuous_riccati(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R) {
  require_square(A, "continuous_riccati: A");
  require_rows(B, A.rows(), "continuous_riccati: B");
  return solve(A, B, Q, R, {"continuous_riccati", "(A, B) is not stabilisable: B does not reach", "Q does not see"});
}

RiccatiSolution filter_riccati(const Matrix& A, const Matrix& C, const Matrix& Q, const Matrix& R) {
  require_square(A, "filter_riccati: A");
  require_columns(C, A.rows(), "filter_riccati: C");
  RiccatiSolution solution =
      solve(A.transpose(), C.transpose(), Q, R, {"filter_riccati", "(A, C) is not detectable: C does not see", "Q does not excite"});
  solution.K.transposeInPlace();
  return solution;
}

Matrix lqr_gain(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R) { return continuous_riccati(A, B, Q, R).K; }

}  // namespace consort
