#include "core/gaussian.hpp"

#include "core/errors.hpp"

namespace consort {

Gaussian::Gaussian(const Matrix& covariance) {
  if (covariance.size() == 0 || covariance.isZero(0.0)) return;
  if (covariance.isDiagonal(0.0)) {
    deviations_ = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
    return;
  }
  // LDLT with pivoting, because the covariance may be singular.
  const Eigen::LDLT<Matrix> ldlt(covariance);
  const Vector deviations = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  factor_ = Matrix(ldlt.matrixL()) * deviations.asDiagonal();
  factor_ = ldlt.transpositionsP().transpose() * factor_;
}

void Gaussian::add(Stream stream, std::span<double> vector) const {
  if (zero()) return;
  check(static_cast<Eigen::Index>(vector.size()) == deviations_.size() + factor_.rows(),
        "Gaussian::add: the vector has another size than the covariance");
  Eigen::Map<Vector> disturbed(vector.data(), static_cast<Eigen::Index>(vector.size()));
  for (Eigen::Index c = 0; c < disturbed.size(); ++c) {
    const double draw = stream.normal();
    if (factor_.size() > 0) {
      disturbed += draw * factor_.col(c);
    } else {
      disturbed(c) += draw * deviations_(c);
    }
  }
}

}  // namespace consort
