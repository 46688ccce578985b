#pragma once
/// What a link does to the messages that cross it: loss, delay, copies, overtaking, noise, quantisation. All draws keyed by (sender,
/// receiver, round of emission), so they are the same in every mode and whether or not the link carries anything in a round.

#include "core/gaussian.hpp"
#include "core/random.hpp"
#include "core/types.hpp"

#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace consort {

inline constexpr Round kLongestDelay = 65536;  ///< rounds; a longer draw is cut

/// Losses in bursts (Gilbert 1960, Elliott 1963): a link is good or bad; from round to round it changes with these probabilities, beginning
/// in its stationary distribution.
struct BurstLoss {
  double good_to_bad = 0.0, bad_to_good = 1.0;   ///< not both 0
  double loss_in_good = 0.0, loss_in_bad = 1.0;  ///< of a message sent in such a round
  [[nodiscard]] double bad_share() const { return good_to_bad / (good_to_bad + bad_to_good); }
  [[nodiscard]] double mean_loss() const { return loss_in_good + bad_share() * (loss_in_bad - loss_in_good); }
  /// Mean number of messages lost on end, of a message per round.
  [[nodiscard]] double mean_burst() const;
  bool operator==(const BurstLoss&) const = default;
};

/// Loss that grows with the distance between the two agents in the round of emission: none up to `safe`, everything from `lost` on, in
/// between in proportion.
struct DistanceLoss {
  double safe = 0.0, lost = 1.0;  ///< in the unit of the plant's positions
  [[nodiscard]] double probability(double distance) const;
  bool operator==(const DistanceLoss&) const = default;
};

/// What a message is late beyond `delay_rounds`. A draw is rounded up to whole rounds.
struct Jitter {
  enum class Kind : std::uint8_t {
    none,
    uniform,      ///< 0, 1, ..., spread, equally likely
    exponential,  ///< of this mean
    normal        ///< N(mean, spread^2), truncated to what is not negative
  };
  Kind kind = Kind::none;
  double mean = 0.0, spread = 0.0;  ///< rounds
  bool operator==(const Jitter&) const = default;
};

/// With this probability a message takes so many rounds longer: those sent after it overtake it.
struct Reordering {
  double probability = 0.0;
  Round later_rounds = 1;
  bool operator==(const Reordering&) const = default;
};

/// 2^bits levels, equally spaced from low to high; a number becomes the nearest one.
struct Quantiser {
  std::uint32_t bits = 8;  ///< 1 to 32
  double low = -1.0, high = 1.0;
  [[nodiscard]] double step() const;
  void apply(std::span<double> field) const;
  bool operator==(const Quantiser&) const = default;
};

/// One link. `noise_covariance` is scalar (1x1, times identity), a diagonal (n x 1) or n x n; an empty matrix is no noise. Several causes
/// of loss are independent: a message arrives if it survives each.
struct LinkSpec {
  double loss_probability = 0.0;  ///< Bernoulli, in [0, 1]
  Round delay_rounds = 0;         ///< whole rounds
  Matrix noise_covariance{};      ///< in the squared unit of the disturbed message field
  std::optional<BurstLoss> bursts = {};
  Jitter jitter = {};
  double duplication = 0.0;  ///< probability of a second copy, with a delay of its own
  std::optional<Reordering> reordering = {};
  std::optional<Quantiser> quantiser = {};  ///< of the disturbed message field, after the noise
  std::optional<DistanceLoss> distance = {};
  [[nodiscard]] bool ideal() const { return *this == LinkSpec{}; }
  [[nodiscard]] bool delays() const { return delay_rounds > 0 || jitter.kind != Jitter::Kind::none || reordering; }
  [[nodiscard]] bool loses() const { return loss_probability > 0.0 || bursts || distance; }
  /// Of all causes but distance.
  [[nodiscard]] double mean_loss() const { return 1.0 - (1.0 - loss_probability) * (1.0 - (bursts ? bursts->mean_loss() : 0.0)); }
  bool operator==(const LinkSpec&) const;
};

/// What is wrong with the numbers of a link, as `what was found; allowed: ...`; nothing: they make sense. (The noise is judged by Link.)
std::optional<std::string> objection(const LinkSpec& spec);

/// The links of an experiment: a default, exceptions by edge, and what changes on the way.
struct LinkModel {
  /// From round `since` on, `edge` (nothing: every link without a rule of its own) is as `spec` says.
  struct Change {
    Round since = 0;
    std::optional<Edge> edge;
    LinkSpec spec;
  };
  LinkSpec standard;
  std::map<Edge, LinkSpec> overrides;
  std::vector<Change> changes = {};  ///< ascending by `since`; of equal rounds the later entry counts

  [[nodiscard]] const LinkSpec& of(Edge edge, Round k = 0) const;
  /// What the edge is, and from which round on: ascending, the first from round 0.
  [[nodiscard]] std::vector<std::pair<Round, LinkSpec>> periods(Edge edge) const;
  /// What concerns the in-links of `agent` alone, ascending; an exception is a change in round 0.
  [[nodiscard]] std::vector<Change> changes_into(AgentId agent) const;
  /// Has some link a loss that depends on distance?
  [[nodiscard]] bool asks_distances() const;
  /// Calls `each` with every specification in the model.
  template <class Each>
  void for_each(Each&& each) const {
    each(standard);
    for (const auto& [edge, spec] : overrides) each(spec);
    for (const Change& change : changes) each(change.spec);
  }
};

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
