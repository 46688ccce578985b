#pragma once
/// What a link does to the messages that cross it: loss, delay, copies, overtaking, noise, quantisation. All draws keyed by (sender,
/// receiver, round of emission), so they are the same in every mode and whether or not the link carries anything in a round.

#include "core/gaussian.hpp"
#include "core/network/link_spec.hpp"
#include "core/random.hpp"

#include <optional>
#include <span>
#include <utility>

namespace consort {

/// One link ready to use: covariance factored, draws keyed. Every answer is a function of the round it is asked for.
class Link {
 public:
  /// Throws ConfigError on numbers that make no sense and on a covariance of wrong size or not positive semidefinite.
  Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed);
  /// Is the message of round `sent` lost, the agents being `distance` apart in that round?
  [[nodiscard]] bool lost(Round sent, double distance = 0.0) const;
  [[nodiscard]] Round delay(Round sent) const;  ///< rounds that the message of round `sent` is under way
  /// The same of the message's second copy; nothing: there is none.
  [[nodiscard]] std::optional<Round> copy_delay(Round sent) const;
  [[nodiscard]] bool disturbs() const { return !noise_.zero() || (spec_.quantiser && noise_dimension_ > 0); }
  void disturb(Round sent, std::span<double> field) const;  ///< adds N(0, covariance), then quantises
  [[nodiscard]] bool ideal() const { return ideal_; }
  /// Gilbert and Elliott's state in round k; false without bursts.
  [[nodiscard]] bool bad(Round k) const;

 private:
  [[nodiscard]] Stream stream(Purpose purpose, Round sent) const { return seed_.stream(purpose, edge_.from.value, edge_.to.value, sent); }
  [[nodiscard]] Round drawn_delay(Stream& stream) const;

  Edge edge_;
  Seed seed_;
  LinkSpec spec_;
  Eigen::Index noise_dimension_;
  Gaussian noise_;
  bool ideal_;
  /// The state asked for last: the next question need not look further back. Never changes an answer.
  mutable std::optional<std::pair<Round, bool>> known_;
};

}  // namespace consort
