#pragma once
/// What a link does to the messages that cross it, in numbers. Each effect says once what it is: its numbers, how files call them, what
/// they may be and what they mean. The reader of the experiment file, its schema, the resolved file, the wire and the words for people ask
/// `fields`, so a new effect is a struct and a line here, and its draw in `Link`.

#include "core/types.hpp"
#include "core/values.hpp"

#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace consort {

inline constexpr Round kLongestDelay = 65536;  ///< rounds; a longer draw is cut

/// What files call a number (or a pair of them), or an effect; its document; what it may be.
struct LinkKey {
  std::string_view name = {}, title = {}, meaning = {};
  double least = 0.0, most = 1.0;
  bool required = true;  ///< in its effect; else the effect's own default is meant
  bool of_loss = false;  ///< an effect that files have below `loss`
  double example = 0.1;  ///< of an effect that is one number
};
inline constexpr double kNoBound = std::numeric_limits<double>::infinity();

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

  static void fields(auto&& visit) {
    visit(LinkKey{"p_good_to_bad", "Good to bad", "Probability per round."}, &BurstLoss::good_to_bad);
    visit(LinkKey{"p_bad_to_good", "Bad to good", "Probability per round; bad times last 1/p rounds on average."}, &BurstLoss::bad_to_good);
    visit(LinkKey{.name = "loss_in_good", .title = "Loss in the good state", .meaning = "Probability.", .required = false},
          &BurstLoss::loss_in_good);
    visit(LinkKey{.name = "loss_in_bad", .title = "Loss in the bad state", .meaning = "Probability.", .required = false},
          &BurstLoss::loss_in_bad);
  }
  static BurstLoss example() { return {0.02, 0.2, 0.01, 0.8}; }
  [[nodiscard]] std::optional<std::string> objection() const;  ///< beyond each number's own bounds
  [[nodiscard]] std::string words() const;
};

/// Loss that grows with the distance between the two agents in the round of emission: none up to `safe`, everything from `lost` on, in
/// between in proportion.
struct DistanceLoss {
  double safe = 0.0, lost = 1.0;  ///< in the unit of the plant's positions
  [[nodiscard]] double probability(double distance) const;
  bool operator==(const DistanceLoss&) const = default;

  static void fields(auto&& visit) {
    visit(LinkKey{"safe", "Safe", "Distance up to which nothing is lost, in the unit of the positions.", 0.0, kNoBound},
          &DistanceLoss::safe);
    visit(LinkKey{"lost", "Lost", "Distance from which everything is lost, above safe.", 0.0, kNoBound}, &DistanceLoss::lost);
  }
  static DistanceLoss example() { return {5.0, 20.0}; }
  [[nodiscard]] std::optional<std::string> objection() const;
  [[nodiscard]] std::string words() const;
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

  static void fields(auto&& visit) {
    visit(LinkKey{"probability", "Probability", "Of each message."}, &Reordering::probability);
    visit(LinkKey{"later_rounds", "Later by", "Whole rounds.", 1.0, kLongestDelay, false}, &Reordering::later_rounds);
  }
  static Reordering example() { return {0.1, 2}; }
  [[nodiscard]] std::optional<std::string> objection() const { return std::nullopt; }
  [[nodiscard]] std::string words() const;
};

/// 2^bits levels, equally spaced from low to high; a number becomes the nearest one.
struct Quantiser {
  std::uint32_t bits = 8;
  double low = -1.0, high = 1.0;
  [[nodiscard]] double step() const;
  void apply(std::span<double> field) const;
  bool operator==(const Quantiser&) const = default;

  static void fields(auto&& visit) {
    visit(LinkKey{"bits", "Bits", "1 to 32.", 1.0, 32.0}, &Quantiser::bits);
    visit(LinkKey{"range", "Range", "[low, high], lowest and highest level.", -kNoBound, kNoBound}, &Quantiser::low, &Quantiser::high);
  }
  static Quantiser example() { return {8, -10.0, 10.0}; }
  [[nodiscard]] std::optional<std::string> objection() const;
  [[nodiscard]] std::string words() const;
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

  /// Calls `visit(LinkKey, pointer to member)` for each effect. `jitter` belongs to the delay: files have both as one.
  static void fields(auto&& visit) {
    visit(LinkKey{.name = "bernoulli", .title = "Bernoulli", .meaning = "Probability of loss, 0 to 1.", .of_loss = true},
          &LinkSpec::loss_probability);
    visit(LinkKey{.name = "gilbert_elliott",
                  .title = "Gilbert-Elliott",
                  .meaning = "Losses in bursts: a link is good or bad and changes from round to round, beginning in its stationary "
                             "distribution.",
                  .of_loss = true},
          &LinkSpec::bursts);
    visit(LinkKey{.name = "distance",
                  .title = "Loss by distance",
                  .meaning = "Nothing is lost up to the distance `safe`, everything from `lost` on, in between in proportion. The "
                             "plant's state must have a part named position.",
                  .of_loss = true},
          &LinkSpec::distance);
    visit(LinkKey{.name = "delay_rounds", .most = kLongestDelay}, &LinkSpec::delay_rounds);
    visit(LinkKey{.name = "jitter", .most = kLongestDelay}, &LinkSpec::jitter);
    visit(LinkKey{.name = "duplication",
                  .title = "Duplication",
                  .meaning = "Probability that a second copy of a message arrives, with a delay of its own.",
                  .example = 0.05},
          &LinkSpec::duplication);
    visit(LinkKey{"reordering", "Reordering", "With this probability a message takes so many rounds longer, and later ones overtake it."},
          &LinkSpec::reordering);
    visit(LinkKey{"noise_covariance"}, &LinkSpec::noise_covariance);
    visit(LinkKey{"quantisation", "Quantisation",
                  "The exchanged state is rounded to the nearest of 2^bits levels, equally spaced over the range, and saturates at its "
                  "ends; after the noise."},
          &LinkSpec::quantiser);
  }

  [[nodiscard]] bool ideal() const;
  [[nodiscard]] bool delays() const { return delay_rounds > 0 || jitter.kind != Jitter::Kind::none || reordering; }
  [[nodiscard]] bool loses() const;
  /// Of all causes but distance.
  [[nodiscard]] double mean_loss() const { return 1.0 - (1.0 - loss_probability) * (1.0 - (bursts ? bursts->mean_loss() : 0.0)); }
  bool operator==(const LinkSpec&) const;
};

/// What is wrong with the numbers of a link, as `what was found; allowed: ...`; nothing: they make sense. (The noise is judged by Link.)
std::optional<std::string> objection(const LinkSpec& spec);
/// "loss 0.1, delay 2 rounds", or "ideal".
std::string words_of(const LinkSpec& link);
/// The effects of a link by name, each with its numbers in their order; what does nothing is left out.
Values values_of(const LinkSpec& link);
/// The link of such values. Throws ConfigError on an effect that does not exist, too many or too few numbers, and what makes no sense.
LinkSpec link_of(const Values& values);

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

}  // namespace consort
