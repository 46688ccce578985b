#include "orchestrator/script/link_reader.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "core/values.hpp"

#include <fmt/format.h>

#include <utility>

namespace consort::script {
namespace {

constexpr Range kRoundsOfDelay{0.0, static_cast<double>(kLongestDelay), false};

// Reads the keys of one link into what they change.
class LinkReader {
 public:
  LinkReader(Mistakes& mistakes, Seconds dt, const Section& section, std::string what)
      : mistakes_(mistakes), dt_(dt), section_(section), what_(std::move(what)) {}

  LinkPatch read() && {
    const std::size_t before = mistakes_.count();
    if (const auto node = section_.find("loss"); present(node)) read_loss(node, section_.path("loss"));
    if (present(section_.find("delay")) && present(section_.find("delay_rounds")))
      mistakes_.add(section_.find("delay"), section_.path("delay") + ": found both 'delay' and 'delay_rounds'; allowed: one of them");
    for (const char* delay : {"delay", "delay_rounds"})
      if (const auto node = section_.find(delay); present(node)) read_delay(node, section_.path(delay), delay == std::string_view("delay"));
    read_effects(section_, false);
    if (mistakes_.count() == before) {
      LinkSpec tried;
      change_by(patch_, tried);
      if (const auto found = objection(tried)) mistakes_.add(section_.node(), what_ + ": found " + *found);
    }
    return std::move(patch_);
  }

 private:
  void change(std::function<void(LinkSpec&)> apply) { patch_.push_back(std::move(apply)); }

  // All effects but the delay, whose two members files have as one.
  void read_effects(const Section& section, bool of_loss) {
    LinkSpec::fields([&](const LinkKey& key, auto member) {
      if constexpr (!std::is_same_v<decltype(member), Round LinkSpec::*> && !std::is_same_v<decltype(member), Jitter LinkSpec::*>) {
        const std::string name(key.name);
        if (key.of_loss != of_loss) return;
        if (const auto node = section.find(name); present(node)) read_effect(node, section.path(name), key, member);
      }
    });
  }

  void read_number_into(double& to, const YAML::Node& node, const std::string& what, const LinkKey& key) {
    to = read_number(mistakes_, node, what, {key.least, key.most}).value_or(to);
  }
  void read_number_into(std::uint32_t& to, const YAML::Node& node, const std::string& what, const LinkKey& key) {
    const auto least = static_cast<std::uint64_t>(key.least), most = static_cast<std::uint64_t>(key.most);
    to = static_cast<std::uint32_t>(read_whole(mistakes_, node, what, least, most).value_or(to));
  }

  void read_effect(const YAML::Node& node, const std::string& what, const LinkKey& key, double LinkSpec::*member) {
    double read = 0.0;
    read_number_into(read, node, what, key);
    change([member, read](LinkSpec& link) { link.*member = read; });
  }

  template <class Effect>
  void read_effect(const YAML::Node& node, const std::string& what, const LinkKey& key, std::optional<Effect> LinkSpec::*member) {
    if (!key.of_loss && node.IsScalar() && node.Scalar() == "none") return change([member](LinkSpec& link) { (link.*member).reset(); });
    const Section section(mistakes_, node, what, fmt::format("/definitions/{}{}", key.name, key.of_loss ? "" : "/oneOf/1"));
    if (!section.is_map()) return;
    Effect read;
    Effect::fields([&](const LinkKey& number, auto... members) {
      const std::string name(number.name);
      const auto given = number.required ? section.required(name) : section.find(name);
      if (!present(given)) return;
      if constexpr (sizeof...(members) == 1)
        (read_number_into(read.*members, given, section.path(name), number), ...);
      else
        read_pair(given, section.path(name), read.*members...);
    });
    change([member, read](LinkSpec& link) { link.*member = read; });
  }

  void read_pair(const YAML::Node& node, const std::string& what, double& low, double& high) {
    const bool two = node.IsSequence() && node.size() == 2;
    const auto first = two ? plain_number(node[0]) : std::nullopt, second = first ? plain_number(node[1]) : std::nullopt;
    if (!second || !(*first < *second)) {
      mistakes_.add(node, fmt::format("{}: found {}; allowed: [low, high], two numbers, ascending", what, describe(node)));
      return;
    }
    low = *first;
    high = *second;
  }

  // Whatever is lost is said anew: a cause that is not mentioned is none.
  void read_loss(const YAML::Node& node, const std::string& what) {
    LinkSpec::fields([this](const LinkKey& key, auto member) {
      if (key.of_loss) change([member](LinkSpec& link) { link.*member = LinkSpec().*member; });
    });
    if (!node.IsMap()) return read_effect(node, what, LinkKey{}, &LinkSpec::loss_probability);
    const Section loss(mistakes_, node, what, "/definitions/loss/oneOf/1");
    read_effects(loss, true);
  }

  // A delay in rounds, not rounded: a time (`timed`) or a number of rounds.
  double rounds_in(const YAML::Node& node, const std::string& what, bool timed) {
    if (!timed) return read_number(mistakes_, node, what, kRoundsOfDelay).value_or(0.0);
    if (const auto number = plain_number(node); number && *number == 0.0) return 0.0;
    const double rounds = read_duration(mistakes_, node, what).value_or(0.0) / dt_;
    if (!kRoundsOfDelay.holds(rounds))
      mistakes_.add(node, fmt::format("{}: found {}, {} rounds of dt = {} s; allowed: up to {} rounds", what, describe(node),
                                      number_text(rounds), number_text(dt_), kLongestDelay));
    return rounds;
  }

  // The same in whole rounds: a time is rounded up, a number of rounds is whole.
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

  void read_effect(const YAML::Node& node, const std::string& what, const LinkKey&, Matrix LinkSpec::*member) {
    auto covariance = read_matrix(mistakes_, node, what);
    if (!covariance) return;
    try {
      Values values;
      values.set("noise_covariance", *covariance);
      static_cast<void>(values.covariance("noise_covariance", covariance->rows()));  // for its objections
      if (covariance->isZero(0.0)) covariance->resize(0, 0);
      change([member, read = *covariance](LinkSpec& link) { link.*member = read; });
    } catch (const ConfigError& error) {
      mistakes_.add(node, fmt::format("{}: {}", what, error.what()));
    }
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
