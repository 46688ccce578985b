#include "orchestrator/script/link_reader.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/values.hpp"

#include <fmt/format.h>

#include <utility>

namespace consort::script {
namespace {

constexpr Range kRoundsOfDelay{0.0, static_cast<double>(kLongestDelay), false};

/// Reads the keys of one link into what they change.
class LinkReader {
 public:
  LinkReader(Mistakes& mistakes, Seconds dt, const Section& section, std::string what)
      : mistakes_(mistakes), dt_(dt), section_(section), what_(std::move(what)) {}

  LinkPatch read() && {
    const std::size_t before = mistakes_.count();
    const auto with = [this](const char* key, auto take) {
      if (const auto node = section_.find(key); present(node)) take(node, section_.path(key));
    };
    with("loss", [this](const auto& node, const std::string& what) { read_loss(node, what); });
    if (present(section_.find("delay")) && present(section_.find("delay_rounds")))
      mistakes_.add(section_.find("delay"), section_.path("delay") + ": found both 'delay' and 'delay_rounds'; allowed: one of them");
    with("delay", [this](const auto& node, const std::string& what) { read_delay(node, what, true); });
    with("delay_rounds", [this](const auto& node, const std::string& what) { read_delay(node, what, false); });
    with("duplication", [this](const auto& node, const std::string& what) {
      if (const auto p = read_number(mistakes_, node, what, kProbability)) change([p = *p](LinkSpec& link) { link.duplication = p; });
    });
    with("reordering", [this](const auto& node, const std::string& what) { read_reordering(node, what); });
    with("noise_covariance", [this](const auto& node, const std::string& what) { read_noise(node, what); });
    with("quantisation", [this](const auto& node, const std::string& what) { read_quantisation(node, what); });
    if (mistakes_.count() == before) {
      LinkSpec tried;
      for (const auto& apply : patch_) apply(tried);
      if (const auto found = objection(tried)) mistakes_.add(section_.node(), what_ + ": found " + *found);
    }
    return std::move(patch_);
  }

 private:
  void change(std::function<void(LinkSpec&)> apply) { patch_.push_back(std::move(apply)); }

  static bool none(const YAML::Node& node) { return node.IsScalar() && node.Scalar() == "none"; }

  double probability(const Section& section, const char* key, std::optional<double> otherwise = std::nullopt) {
    const auto node = otherwise ? section.find(key) : section.required(key);
    return present(node) ? read_number(mistakes_, node, section.path(key), kProbability).value_or(0.0) : otherwise.value_or(0.0);
  }

  void read_loss(const YAML::Node& node, const std::string& what) {
    LinkSpec read;
    if (node.IsMap()) {
      const Section loss(mistakes_, node, what, "/definitions/loss/oneOf/1");
      if (present(loss.find("bernoulli"))) read.loss_probability = probability(loss, "bernoulli");
      if (const auto bursts = loss.find("gilbert_elliott"); present(bursts)) {
        const Section part(mistakes_, bursts, loss.path("gilbert_elliott"), "/definitions/gilbert_elliott");
        if (!part.is_map()) return;
        read.bursts = BurstLoss{probability(part, "p_good_to_bad"), probability(part, "p_bad_to_good"),
                                probability(part, "loss_in_good", 0.0), probability(part, "loss_in_bad", 1.0)};
      }
      if (const auto distance = loss.find("distance"); present(distance)) {
        const Section part(mistakes_, distance, loss.path("distance"), "/definitions/distance_loss");
        if (!part.is_map()) return;
        read.distance = DistanceLoss{distance_in(part, "safe"), distance_in(part, "lost")};
      }
    } else {
      read.loss_probability = read_number(mistakes_, node, what, kProbability).value_or(0.0);
    }
    change([read](LinkSpec& link) {
      link.loss_probability = read.loss_probability;
      link.bursts = read.bursts;
      link.distance = read.distance;
    });
  }

  double distance_in(const Section& section, const char* key) {
    const auto node = section.required(key);
    return present(node) ? read_number(mistakes_, node, section.path(key), {0.0, kUnbounded, false}).value_or(0.0) : 0.0;
  }

  /// A delay in rounds, not rounded: a time (`timed`) or a number of rounds.
  double rounds_in(const YAML::Node& node, const std::string& what, bool timed) {
    if (!timed) return read_number(mistakes_, node, what, kRoundsOfDelay).value_or(0.0);
    if (const auto number = plain_number(node); number && *number == 0.0) return 0.0;
    const double rounds = read_duration(mistakes_, node, what).value_or(0.0) / dt_;
    if (!kRoundsOfDelay.holds(rounds))
      mistakes_.add(node, fmt::format("{}: found {}, {} rounds of dt = {} s; allowed: up to {} rounds", what, describe(node),
                                      number_text(rounds), number_text(dt_), kLongestDelay));
    return rounds;
  }

  /// The same in whole rounds: a time is rounded up, a number of rounds is whole.
  Round whole_rounds_in(const YAML::Node& node, const std::string& what, bool timed) {
    if (!timed) return static_cast<Round>(read_whole(mistakes_, node, what, 0, kLongestDelay).value_or(0));
    const double rounds = rounds_in(node, what, timed);
    return kRoundsOfDelay.holds(rounds) ? static_cast<Round>(first_round_from(rounds)) : 0;
  }

  void read_delay(const YAML::Node& node, const std::string& what, bool timed) {
    Round least = 0;
    Jitter jitter;
    if (!node.IsMap()) {
      least = whole_rounds_in(node, what, timed);
    } else {
      const char* pointer = timed ? "/definitions/delay/oneOf/2" : "/definitions/delay_rounds/oneOf/1";
      const Section section(mistakes_, node, what, pointer);
      if (node.size() != 1) {
        mistakes_.add(node,
                      fmt::format("{}: found {}; allowed: exactly one of uniform, exponential, normal", what, counted(node.size(), "key")));
        return;
      }
      if (const auto part = section.find("uniform"); present(part)) read_uniform(part, section.path("uniform"), timed, least, jitter);
      if (const auto part = section.find("exponential"); present(part)) {
        const Section keys(mistakes_, part, section.path("exponential"), std::string(pointer) + "/properties/exponential");
        if (const auto shortest = keys.find("shortest"); present(shortest)) least = whole_rounds_in(shortest, keys.path("shortest"), timed);
        jitter.kind = Jitter::Kind::exponential;
        if (const auto mean = keys.required("mean"); present(mean)) jitter.mean = rounds_in(mean, keys.path("mean"), timed);
      }
      if (const auto part = section.find("normal"); present(part)) {
        const Section keys(mistakes_, part, section.path("normal"), std::string(pointer) + "/properties/normal");
        jitter.kind = Jitter::Kind::normal;
        if (const auto mean = keys.required("mean"); present(mean)) jitter.mean = rounds_in(mean, keys.path("mean"), timed);
        if (const auto spread = keys.required("deviation"); present(spread))
          jitter.spread = rounds_in(spread, keys.path("deviation"), timed);
      }
    }
    change([least, jitter](LinkSpec& link) {
      link.delay_rounds = least;
      link.jitter = jitter;
    });
  }

  void read_uniform(const YAML::Node& node, const std::string& what, bool timed, Round& least, Jitter& jitter) {
    if (!node.IsSequence() || node.size() != 2) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: [shortest, longest]", what, describe(node)));
      return;
    }
    least = whole_rounds_in(node[0], what + "[0]", timed);
    const Round most = whole_rounds_in(node[1], what + "[1]", timed);
    if (most < least) {
      mistakes_.add(node, fmt::format("{}: found {} to {} rounds; allowed: ascending", what, least, most));
      return;
    }
    jitter = {Jitter::Kind::uniform, 0.0, static_cast<double>(most - least)};
  }

  void read_reordering(const YAML::Node& node, const std::string& what) {
    if (none(node)) return change([](LinkSpec& link) { link.reordering.reset(); });
    const Section section(mistakes_, node, what, "/definitions/reordering/oneOf/1");
    if (!section.is_map()) return;
    Reordering read{probability(section, "probability"), 1};
    if (const auto later = section.find("later_rounds"); present(later))
      read.later_rounds = static_cast<Round>(read_whole(mistakes_, later, section.path("later_rounds"), 1, kLongestDelay).value_or(1));
    change([read](LinkSpec& link) { link.reordering = read; });
  }

  void read_noise(const YAML::Node& node, const std::string& what) {
    auto covariance = read_matrix(mistakes_, node, what);
    if (!covariance) return;
    try {
      Values values;
      values.set("noise_covariance", *covariance);
      static_cast<void>(values.covariance("noise_covariance", covariance->rows()));  // for its objections
      if (covariance->isZero(0.0)) covariance->resize(0, 0);
      change([read = *covariance](LinkSpec& link) { link.noise_covariance = read; });
    } catch (const ConfigError& error) {
      mistakes_.add(node, fmt::format("{}: {}", what, error.what()));
    }
  }

  void read_quantisation(const YAML::Node& node, const std::string& what) {
    if (none(node)) return change([](LinkSpec& link) { link.quantiser.reset(); });
    const Section section(mistakes_, node, what, "/definitions/quantisation/oneOf/1");
    if (!section.is_map()) return;
    Quantiser read;
    if (const auto bits = section.required("bits"); present(bits))
      read.bits = static_cast<std::uint32_t>(read_whole(mistakes_, bits, section.path("bits"), 1, 32).value_or(1));
    const auto range = section.required("range");
    if (!present(range)) return;
    const auto low = range.IsSequence() && range.size() == 2 ? plain_number(range[0]) : std::nullopt;
    const auto high = low ? plain_number(range[1]) : std::nullopt;
    if (!high || !(*low < *high)) {
      mistakes_.add(range,
                    fmt::format("{}: found {}; allowed: [low, high], two numbers, ascending", section.path("range"), describe(range)));
      return;
    }
    read.low = *low;
    read.high = *high;
    change([read](LinkSpec& link) { link.quantiser = read; });
  }

  Mistakes& mistakes_;
  Seconds dt_;
  const Section& section_;
  std::string what_;
  LinkPatch patch_;
};

}  // namespace

LinkPatch read_link(Mistakes& mistakes, Seconds dt, const Section& section, const std::string& what) {
  return LinkReader(mistakes, dt, section, what).read();
}

void change_by(const LinkPatch& patch, LinkSpec& link) {
  for (const auto& change : patch) change(link);
}

}  // namespace consort::script
