#pragma once
/// What a link does to the messages that cross it: loss, delay, additive noise. All draws keyed by (sender, receiver, round).

#include "core/gaussian.hpp"
#include "core/random.hpp"
#include "core/types.hpp"

#include <map>
#include <span>

namespace consort {

/// One link. `noise_covariance` is scalar (1x1, times identity), a diagonal (n x 1) or n x n; an empty matrix is no noise.
struct LinkSpec {
  double loss_probability = 0.0;  ///< Bernoulli, in [0, 1]
  Round delay_rounds = 0;         ///< whole rounds
  Matrix noise_covariance{};      ///< in the squared unit of the disturbed message field
  [[nodiscard]] bool ideal() const { return loss_probability == 0.0 && delay_rounds == 0 && noise_covariance.size() == 0; }
};

/// The links of an experiment: a default and exceptions by edge.
struct LinkModel {
  LinkSpec standard;
  std::map<Edge, LinkSpec> overrides;
  [[nodiscard]] const LinkSpec& of(Edge edge) const {
    const auto it = overrides.find(edge);
    return it == overrides.end() ? standard : it->second;
  }
};

/// One link ready to use: covariance factored, draws keyed. Pure.
class Link {
 public:
  /// Throws ConfigError on a loss probability outside [0, 1] and on a covariance of wrong size or not positive semidefinite.
  Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed);
  [[nodiscard]] bool lost(Round sent) const;
  [[nodiscard]] Round delay([[maybe_unused]] Round sent) const {
    return delay_rounds_;
  }  ///< rounds that the message of round `sent` is under way
  [[nodiscard]] bool noisy() const { return !noise_.zero(); }
  void add_noise(Round sent, std::span<double> field) const;  ///< adds N(0, covariance)
  [[nodiscard]] bool ideal() const { return ideal_; }

 private:
  Edge edge_;
  Seed seed_;
  double loss_probability_;
  Round delay_rounds_;
  Gaussian noise_;
  bool ideal_;
};

}  // namespace consort
