#include "core/math/riccati.hpp"

#include "core/errors.hpp"
#include "core/math/controllability.hpp"
#include "core/math/schur.hpp"
#include "core/math/shapes.hpp"

#include <cmath>
#include <limits>

namespace consort {

namespace {

constexpr double kLargestResidual = 1e-8;
constexpr int kRefinements = 4;

// The equation as its user knows it; the filter's is solved as the control equation of (A', C').
struct Wording {
  std::string name;       // of the function
  std::string pair;       // "(A, B) is not stabilisable: B does not reach"
  std::string weighting;  // "Q does not see"
};

struct Terms {
  Matrix A, H, Q;  // A'P + P A - P H'H P + Q = 0; H P is small where P is large, so H'H is not multiplied out
};

// Symplectic balancing: s such that the Hamiltonian of z = diag(s) x has rows and columns of comparable size.
Vector scaling_of(const Matrix& hamiltonian) {
  const Eigen::Index n = hamiltonian.rows() / 2;
  const Vector powers = balancing(hamiltonian);
  Vector scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale(i) = std::ldexp(1.0, (std::ilogb(powers(n + i)) - std::ilogb(powers(i))) / 2);
  return scale;
}

Matrix hamiltonian_of(const Terms& terms) {
  const Eigen::Index n = terms.A.rows();
  Matrix hamiltonian(2 * n, 2 * n);
  hamiltonian << terms.A, -terms.H.transpose() * terms.H, -terms.Q, -terms.A.transpose();
  return hamiltonian;
}

// P = U2 U1^-1 from the stable invariant subspace [U1; U2] of the Hamiltonian.
Matrix stabilising_solution(const Terms& terms, const Wording& wording) {
  const Eigen::Index n = terms.A.rows();
  const RealSchur schur = stable_first_schur(hamiltonian_of(terms));
  for (Eigen::Index i = 0; i < 2 * n; ++i) {
    const std::complex<double> value = schur.eigenvalues[static_cast<std::size_t>(i)];
    if ((value.real() < 0.0) != (i < n))
      throw ConfigError(wording.name + ": the Hamiltonian has the eigenvalue " + text_of(value) +
                        " on the imaginary axis within rounding: A (" + shape_of(terms.A) + ") can be stabilised only just, or " +
                        wording.weighting + " all of the axis");
  }
  const Eigen::PartialPivLU<Matrix> factor(schur.U.topLeftCorner(n, n).transpose());
  if (const double reciprocal = factor.rcond(); !(reciprocal > std::numeric_limits<double>::epsilon()))
    throw RunError(wording.name + ": the leading block (" + shape_of(terms.A) + ") of the stable subspace is singular, condition " +
                   text_of(1.0 / reciprocal));
  const Matrix P = factor.solve(schur.U.bottomLeftCorner(n, n).transpose());
  return 0.5 * (P + P.transpose());
}

// What the equation leaves, and its norm over the sum of the norms of its terms.
struct Residual {
  Matrix matrix;
  double relative = 0.0;
};

Residual residual_of(const Terms& terms, const Matrix& P) {
  const Matrix linear = P * terms.A, half = terms.H * P, quadratic = half.transpose() * half;
  Residual residual{linear + linear.transpose() - quadratic + terms.Q, 0.0};
  const double size = 2.0 * linear.norm() + quadratic.norm() + terms.Q.norm();
  if (size != 0.0) residual.relative = residual.matrix.norm() / size;
  return residual;
}

// Newton's steps (Kleinman 1968) from a P that stabilises, as long as they help: a subspace whose U1 is ill-conditioned costs P digits
// that these bring back.
Matrix refined(const Terms& terms, Matrix P) {
  Residual residual = residual_of(terms, P);
  for (int step = 0; step < kRefinements; ++step) {
    const RealSchur loop = real_schur((terms.A - terms.H.transpose() * (terms.H * P)).transpose());
    const Matrix change = loop.U * solve_quasi_triangular(loop.T, -(loop.U.transpose() * residual.matrix * loop.U)) * loop.U.transpose();
    const Matrix next = P + 0.5 * (change + change.transpose());
    Residual left = residual_of(terms, next);
    if (!(left.relative < residual.relative)) break;
    P = next;
    residual = std::move(left);
  }
  return P;
}

// The stabilising solution, computed in balanced coordinates.
Matrix balanced_solution(const Terms& terms, const Wording& wording) {
  const Vector scale = scaling_of(hamiltonian_of(terms)), inverse = scale.cwiseInverse();
  const auto S = scale.asDiagonal(), S_inverse = inverse.asDiagonal();
  const Terms balanced{S * terms.A * S_inverse, terms.H * S, S_inverse * terms.Q * S_inverse};
  return S * refined(balanced, stabilising_solution(balanced, wording)) * S;
}

// `A`, `B` with shapes already checked.
RiccatiSolution solve(const Matrix& A, const Matrix& B, const Matrix& Q, const Matrix& R, const Wording& wording) {
  const Matrix weight = require_symmetric(R, B.cols(), wording.name + ": R", Definiteness::definite);
  Terms terms{A, {}, require_symmetric(Q, A.rows(), wording.name + ": Q", Definiteness::semidefinite)};
  if (const Verdict verdict = stabilisable(A, B); !verdict)
    throw ConfigError(wording.name + ": " + wording.pair + " the eigenvalue " + text_of(*verdict.offending) + " of A");
  if (const Verdict verdict = observable_on_the_axis(A, terms.Q); !verdict)
    throw ConfigError(wording.name + ": (A, Q) leaves an eigenvalue on the imaginary axis: " + wording.weighting + " the eigenvalue " +
                      text_of(*verdict.offending) + " of A");
  const Eigen::LLT<Matrix> factor(weight);
  terms.H = factor.matrixL().solve(B.transpose());
  RiccatiSolution solution;
  solution.P = balanced_solution(terms, wording);
  solution.K = factor.solve(B.transpose() * solution.P);
  solution.abscissa = spectral_abscissa(A - B * solution.K);
  solution.residual = residual_of(terms, solution.P).relative;
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
