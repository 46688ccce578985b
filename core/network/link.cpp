#include "core/network/link.hpp"

#include "core/errors.hpp"
#include "core/values.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace consort {

namespace {

constexpr Purpose kLoss{"link loss"};
constexpr Purpose kState{"link state"};
constexpr Purpose kBurst{"link burst loss"};
constexpr Purpose kDistance{"link distance loss"};
constexpr Purpose kDelay{"link delay"};
constexpr Purpose kCopy{"link copy"};
constexpr Purpose kOvertaken{"link overtaken"};
constexpr Purpose kNoise{"link noise"};

bool probability(double value) { return value >= 0.0 && value <= 1.0; }

template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

std::string refused(const char* what, double found, const char* allowed = "0 to 1") {
  return text(what, ' ', found, "; allowed: ", allowed);
}

std::optional<std::string> objection(const BurstLoss& bursts) {
  for (const auto& [what, value] : {std::pair{"probability from good to bad", bursts.good_to_bad},
                                    {"probability from bad to good", bursts.bad_to_good},
                                    {"loss probability in the good state", bursts.loss_in_good},
                                    {"loss probability in the bad state", bursts.loss_in_bad}})
    if (!probability(value)) return refused(what, value);
  if (bursts.good_to_bad + bursts.bad_to_good == 0.0)
    return "a link that never changes between good and bad; allowed: at least one of the two probabilities above 0";
  return std::nullopt;
}

std::optional<std::string> objection(const Jitter& jitter) {
  const auto within = [](double rounds) { return rounds >= 0.0 && rounds <= kLongestDelay; };
  if (!within(jitter.mean)) return refused("mean delay in rounds", jitter.mean, "0 to 65536");
  if (!within(jitter.spread)) return refused("spread of the delay in rounds", jitter.spread, "0 to 65536");
  if (jitter.kind == Jitter::Kind::uniform && jitter.spread != std::floor(jitter.spread))
    return refused("spread of the uniform delay in rounds", jitter.spread, "a whole number");
  return std::nullopt;
}

}  // namespace

double BurstLoss::mean_burst() const {
  // A burst ends where a loss is followed by none; their number per round is that of bursts.
  const double bad = bad_share();
  const auto kept_after = [this](bool was_bad) {
    const double stays_bad = was_bad ? 1.0 - bad_to_good : good_to_bad;
    return stays_bad * (1.0 - loss_in_bad) + (1.0 - stays_bad) * (1.0 - loss_in_good);
  };
  const double ends = (1.0 - bad) * loss_in_good * kept_after(false) + bad * loss_in_bad * kept_after(true);
  return mean_loss() / ends;
}

double DistanceLoss::probability(double distance) const { return std::clamp((distance - safe) / (lost - safe), 0.0, 1.0); }

double Quantiser::step() const { return (high - low) / static_cast<double>((std::uint64_t{1} << bits) - 1); }

void Quantiser::apply(std::span<double> field) const {
  const double width = step();
  for (double& value : field) {
    const double level = std::round((std::clamp(value, low, high) - low) / width);
    value = std::min(low + level * width, high);
  }
}

bool LinkSpec::operator==(const LinkSpec& other) const {
  const auto same = [](const Matrix& a, const Matrix& b) { return a.rows() == b.rows() && a.cols() == b.cols() && a == b; };
  return loss_probability == other.loss_probability && delay_rounds == other.delay_rounds && bursts == other.bursts &&
         jitter == other.jitter && duplication == other.duplication && reordering == other.reordering && quantiser == other.quantiser &&
         distance == other.distance && same(noise_covariance, other.noise_covariance);
}

std::optional<std::string> objection(const LinkSpec& spec) {
  if (!probability(spec.loss_probability)) return refused("loss probability", spec.loss_probability);
  if (spec.delay_rounds > kLongestDelay) return refused("delay in rounds", spec.delay_rounds, "0 to 65536");
  if (!probability(spec.duplication)) return refused("probability of a copy", spec.duplication);
  if (spec.bursts)
    if (auto found = objection(*spec.bursts)) return found;
  if (auto found = objection(spec.jitter)) return found;
  if (spec.distance && !(spec.distance->safe >= 0.0 && spec.distance->safe < spec.distance->lost && std::isfinite(spec.distance->lost)))
    return text("loss over the distances [", spec.distance->safe, ", ", spec.distance->lost,
                "]; allowed: two distances, not negative and ascending");
  if (spec.reordering) {
    if (!probability(spec.reordering->probability)) return refused("probability of reordering", spec.reordering->probability);
    if (spec.reordering->later_rounds < 1 || spec.reordering->later_rounds > kLongestDelay)
      return refused("reordering by rounds", spec.reordering->later_rounds, "1 to 65536");
  }
  if (const auto& quantiser = spec.quantiser) {
    if (quantiser->bits < 1 || quantiser->bits > 32) return refused("quantisation with bits", quantiser->bits, "1 to 32");
    if (!(std::isfinite(quantiser->low) && std::isfinite(quantiser->high) && quantiser->low < quantiser->high &&
          std::isfinite(quantiser->high - quantiser->low)))
      return text("quantisation over [", quantiser->low, ", ", quantiser->high, "]; allowed: two finite numbers, ascending");
  }
  return std::nullopt;
}

const LinkSpec& LinkModel::of(Edge edge, Round k) const {
  const LinkSpec* own = nullptr;
  const LinkSpec* common = &standard;
  if (const auto it = overrides.find(edge); it != overrides.end()) own = &it->second;
  for (const Change& change : changes) {
    if (change.since > k) break;
    if (!change.edge) common = &change.spec;
    if (change.edge == edge) own = &change.spec;
  }
  return own != nullptr ? *own : *common;
}

std::vector<std::pair<Round, LinkSpec>> LinkModel::periods(Edge edge) const {
  std::vector<std::pair<Round, LinkSpec>> out{{0, of(edge)}};
  for (const Change& change : changes) {
    if (change.edge && change.edge != edge) continue;
    const LinkSpec& spec = of(edge, change.since);
    if (spec == out.back().second) continue;
    if (out.back().first == change.since)
      out.back().second = spec;
    else
      out.emplace_back(change.since, spec);
  }
  return out;
}

std::vector<LinkModel::Change> LinkModel::changes_into(AgentId agent) const {
  std::vector<Change> out;
  for (const auto& [edge, spec] : overrides)
    if (edge.to == agent) out.push_back({0, edge, spec});
  for (const Change& change : changes)
    if (change.edge && change.edge->to == agent) out.push_back(change);
  return out;
}

bool LinkModel::asks_distances() const {
  bool any = false;
  for_each([&any](const LinkSpec& spec) { any = any || spec.distance; });
  return any;
}

Link::Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed)
    : edge_(edge), seed_(seed), spec_(spec), noise_dimension_(noise_dimension) {
  const std::string name = text(edge.from.value, " -> ", edge.to.value);
  if (const auto found = objection(spec)) throw ConfigError("link " + name + ": " + *found);
  if (spec.noise_covariance.size() > 0)
    noise_ = Gaussian(expand_covariance(spec.noise_covariance, noise_dimension, "noise_covariance of link " + name));
  spec_.noise_covariance.resize(0, 0);
  ideal_ = !spec.loses() && !spec.delays() && spec.duplication == 0.0 && !disturbs();
}

bool Link::lost(Round sent, double distance) const {
  if (spec_.loss_probability > 0.0 && stream(kLoss, sent).uniform() < spec_.loss_probability) return true;
  if (spec_.distance && stream(kDistance, sent).uniform() < spec_.distance->probability(distance)) return true;
  if (!spec_.bursts) return false;
  return stream(kBurst, sent).uniform() < (bad(sent) ? spec_.bursts->loss_in_bad : spec_.bursts->loss_in_good);
}

bool Link::bad(Round k) const {
  if (!spec_.bursts) return false;
  // One draw u per round moves either state: from good to bad if u < p, from bad to bad if u < 1 - q. Where both say the same, the round
  // before does not matter, so looking back ends there, and round k needs no history (as in Propp, Wilson 1996).
  const double p = spec_.bursts->good_to_bad, stay = 1.0 - spec_.bursts->bad_to_good;
  bool swapped = false, state = false;
  for (Round r = k;; --r) {
    if (known_ && known_->first == r) {
      state = known_->second;
      break;
    }
    const double u = stream(kState, r).uniform();
    if (r == 0) {
      state = u < spec_.bursts->bad_share();
      break;
    }
    if (u < std::min(p, stay) || u >= std::max(p, stay)) {
      state = u < p;
      break;
    }
    if (p > stay) swapped = !swapped;  // good became bad, bad became good; else the state was kept
  }
  known_ = {k, state != swapped};
  return known_->second;
}

Round Link::drawn_delay(Stream& draws) const {
  const Jitter& jitter = spec_.jitter;
  double late = 0.0;
  switch (jitter.kind) {
    case Jitter::Kind::none:
      break;
    case Jitter::Kind::uniform:
      late = static_cast<double>(draws.below(static_cast<std::uint64_t>(jitter.spread) + 1));
      break;
    case Jitter::Kind::exponential:
      late = -jitter.mean * std::log(1.0 - draws.uniform());
      break;
    case Jitter::Kind::normal:
      do late = jitter.mean + jitter.spread * draws.normal();
      while (late < 0.0);  // the mean is not negative: at least every other draw is right
      break;
  }
  return static_cast<Round>(std::min(std::ceil(late) + spec_.delay_rounds, static_cast<double>(kLongestDelay)));
}

Round Link::delay(Round sent) const {
  Round late = spec_.delay_rounds;
  if (spec_.jitter.kind != Jitter::Kind::none) {
    Stream draws = stream(kDelay, sent);
    late = drawn_delay(draws);
  }
  if (spec_.reordering && stream(kOvertaken, sent).uniform() < spec_.reordering->probability) late += spec_.reordering->later_rounds;
  return late;
}

std::optional<Round> Link::copy_delay(Round sent) const {
  if (spec_.duplication == 0.0) return std::nullopt;
  Stream draws = stream(kCopy, sent);
  if (draws.uniform() >= spec_.duplication) return std::nullopt;
  return drawn_delay(draws);
}

void Link::disturb(Round sent, std::span<double> field) const {
  noise_.add(stream(kNoise, sent), field);
  if (spec_.quantiser) spec_.quantiser->apply(field);
}

}  // namespace consort
