#include "core/link.hpp"

#include "core/errors.hpp"
#include "core/values.hpp"

#include <string>

namespace consort {

namespace {

constexpr Purpose kLoss{"link loss"};
constexpr Purpose kNoise{"link noise"};

}  // namespace

Link::Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed)
    : edge_(edge), seed_(seed), loss_probability_(spec.loss_probability), delay_rounds_(spec.delay_rounds) {
  const std::string name = std::to_string(edge.from.value) + " -> " + std::to_string(edge.to.value);
  if (!(loss_probability_ >= 0.0 && loss_probability_ <= 1.0)) {
    throw ConfigError("link " + name + ": loss probability " + std::to_string(loss_probability_) + "; allowed: 0 to 1");
  }
  if (spec.noise_covariance.size() > 0) {
    noise_ = Gaussian(expand_covariance(spec.noise_covariance, noise_dimension, "noise_covariance of link " + name));
  }
  ideal_ = loss_probability_ == 0.0 && delay_rounds_ == 0 && !noisy();
}

bool Link::lost(Round sent) const {
  if (loss_probability_ == 0.0) return false;
  return seed_.stream(kLoss, edge_.from.value, edge_.to.value, sent).uniform() < loss_probability_;
}

void Link::add_noise(Round sent, std::span<double> field) const {
  noise_.add(seed_.stream(kNoise, edge_.from.value, edge_.to.value, sent), field);
}

}  // namespace consort
