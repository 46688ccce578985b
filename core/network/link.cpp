#include "core/network/link.hpp"

#include "core/errors.hpp"
#include "core/values.hpp"

#include <algorithm>
#include <cmath>
#include <string>

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

}  // namespace

Link::Link(Edge edge, const LinkSpec& spec, Eigen::Index noise_dimension, Seed seed)
    : edge_(edge), seed_(seed), spec_(spec), noise_dimension_(noise_dimension) {
  const std::string name = std::to_string(edge.from.value) + " -> " + std::to_string(edge.to.value);
  if (const auto found = objection(spec)) throw ConfigError("link " + name + ": " + *found);
  if (spec.noise_covariance.size() > 0)
    noise_ = Gaussian(expand_covariance(spec.noise_covariance, noise_dimension, "noise_covariance of link " + name));
  spec_.noise_covariance.resize(0, 0);
  LinkSpec others = spec_;
  others.quantiser.reset();
  ideal_ = others.ideal() && !disturbs();
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
