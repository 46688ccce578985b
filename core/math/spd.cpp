#include "core/math/spd.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"

#include <cmath>
#include <sstream>

namespace consort {

void refuse_matrix(const Place& place, std::string_view matrix, const Matrix& value) {
  std::ostringstream text;
  text << place.algorithm << ": agent " << place.agent.value << ", round " << place.k << ": matrix " << matrix << " (" << value.rows()
       << " x " << value.cols() << ") is not numerically positive definite";
  if (value.allFinite()) {
    const Vector eigenvalues = symmetric_eigenvalues(value);
    const double smallest = eigenvalues.minCoeff(), largest = eigenvalues.cwiseAbs().maxCoeff();
    text << ": eigenvalues in [" << smallest << ", " << eigenvalues.maxCoeff() << "], condition " << largest / std::abs(smallest);
  } else {
    text << ": it has entries that are not finite, condition infinite";
  }
  throw RunError(text.str());
}

template <int N>
void SpdInverse<N>::invert(std::string_view name) {
  constexpr double kSmallestPivot = 1e-14;
  factor_.compute(lower_);
  bool good = factor_.info() == Eigen::Success;
  for (Eigen::Index i = 0; good && i < lower_.rows(); ++i) {
    const double pivot = factor_.matrixLLT()(i, i), entry = lower_(i, i);
    good = pivot * pivot >= kSmallestPivot * entry && entry >= std::numeric_limits<double>::min() &&
           entry <= std::numeric_limits<double>::max();
  }
  if (!good) refuse_matrix(place_, name, lower_);
  // a = L L^T, so its inverse is L^-T L^-1; both halves come from one product, hence the exact symmetry.
  lower_.setIdentity();
  factor_.matrixL().solveInPlace(lower_);
  inverse_.noalias() = lower_.transpose() * lower_;
  inverse_.template triangularView<Eigen::StrictlyUpper>() = inverse_.transpose();
}

template void SpdInverse<2>::invert(std::string_view);
template void SpdInverse<3>::invert(std::string_view);
template void SpdInverse<4>::invert(std::string_view);
template void SpdInverse<6>::invert(std::string_view);
template void SpdInverse<8>::invert(std::string_view);
template void SpdInverse<Eigen::Dynamic>::invert(std::string_view);

}  // namespace consort
