#include "core/link.hpp"

#include "core/errors.hpp"
#include "core/values.hpp"

#include <cmath>
#include <string>

namespace consort {

namespace {

constexpr Purpose kLoss{"link loss"};
constexpr Purpose kNoise{"link noise"};

/// F with F F^T = covariance. LDLT with pivoting, because the covariance may be singular.
Matrix factor_of(const Matrix& covariance) {
  const Eigen::LDLT<Matrix> ldlt(covariance);
  const Vector deviations = ldlt.vectorD().cwiseMax(0.0).cwiseSqrt();
  Matrix factor = Matrix(ldlt.matrixL()) * deviations.asDiagonal();
  return ldlt.transpositionsP().transpose() * factor;
}

}  // namespace

Link::Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed)
    : edge_(edge), seed_(seed), loss_probability_(spec.loss_probability), delay_rounds_(spec.delay_rounds) {
  const std::string name = std::to_string(edge.from.value) + " -> " + std::to_string(edge.to.value);
  if (!(loss_probability_ >= 0.0 && loss_probability_ <= 1.0)) {
    throw ConfigError("link " + name + ": loss probability " + std::to_string(loss_probability_) + "; allowed: 0 to 1");
  }
  if (spec.noise_covariance.size() > 0) {
    const Matrix covariance = expand_covariance(spec.noise_covariance, noise_dimension, "noise_covariance of link " + name);
    if (covariance.size() > 0 && !covariance.isZero(0.0)) {
      if (covariance.isDiagonal(0.0)) {
        deviations_ = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
      } else {
        factor_ = factor_of(covariance);
      }
    }
  }
  ideal_ = loss_probability_ == 0.0 && delay_rounds_ == 0 && !noisy();
}

bool Link::lost(Round sent) const {
  if (loss_probability_ == 0.0) return false;
  return seed_.stream(kLoss, edge_.from.value, edge_.to.value, sent).uniform() < loss_probability_;
}

void Link::add_noise(Round sent, std::span<double> field) const {
  if (!noisy()) return;
  check(static_cast<Eigen::Index>(field.size()) == deviations_.size() + factor_.rows(),
        "Link::add_noise: the field has another size than the covariance");
  Stream stream = seed_.stream(kNoise, edge_.from.value, edge_.to.value, sent);
  Eigen::Map<Vector> disturbed(field.data(), static_cast<Eigen::Index>(field.size()));
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
