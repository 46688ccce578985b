#include "protocols/filters/riccati_step.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <cmath>

namespace consort {

namespace {

Matrix symmetric(const Matrix& value) { return 0.5 * (value + value.transpose()); }

}  // namespace

RiccatiStep::RiccatiStep(const Matrix& A, const Matrix& U, const Matrix& Q, Seconds h) {
  require_square(A, "Riccati step: A");
  const Eigen::Index n = A.rows();
  for (const auto& [value, name] : {std::pair{&U, "Riccati step: U"}, std::pair{&Q, "Riccati step: Q"}}) {
    require_square(*value, name);
    require_rows(*value, n, name);
  }
  // [X; Y]' = [-A' U; Q A] [X; Y] has P = Y X^-1. Y in the unit that makes U and Q alike in size.
  const double u = U.norm(), q = Q.norm(), unit = u > 0.0 && q > 0.0 ? std::sqrt(q / u) : 1.0;
  Matrix hamiltonian(2 * n, 2 * n);
  hamiltonian << -A.transpose(), U * unit, Q / unit, A;
  const double size = (hamiltonian * h).cwiseAbs().rowwise().sum().maxCoeff();
  const int doublings = size > 0.0 && std::isfinite(size) ? std::max(0, 2 + std::ilogb(size)) : 0;  // the short step has norm below 1/2
  const Matrix exponential = matrix_exponential(hamiltonian, std::ldexp(h, -doublings));
  const Matrix first = inverse(exponential.topLeftCorner(n, n), "the leading block of the Riccati step");
  transition_ = first.transpose();
  information_ = symmetric(first * exponential.topRightCorner(n, n)) / unit;
  noise_ = symmetric(exponential.bottomLeftCorner(n, n) * first) * unit;
  const Matrix I = Matrix::Identity(n, n);
  for (int i = 0; i < doublings; ++i) {
    // The step applied to its own result.
    const Matrix between = inverse(I + noise_ * information_, "I + q s of the Riccati step");  // (I + q s)^-1
    const Matrix more_noise = transition_ * (between * noise_) * transition_.transpose();
    const Matrix more_information = transition_.transpose() * (information_ * between) * transition_;
    noise_ = symmetric(noise_ + more_noise);
    information_ = symmetric(information_ + more_information);
    transition_ = (transition_ * between * transition_).eval();
  }
}

Matrix RiccatiStep::operator()(const Matrix& P) const {
  const Eigen::Index n = P.rows();
  // P (I + s P)^-1 = (I + P s)^-1 P
  const Matrix seen = solve(Matrix::Identity(n, n) + P * information_, P, "I + P s of the Riccati step");
  return symmetric(noise_ + transition_ * seen * transition_.transpose());
}

}  // namespace consort
