#include "core/network/link_spec.hpp"

#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/nearest.hpp"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <sstream>

namespace consort {

namespace {

template <class... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream out;
  (out << ... << parts);
  return out.str();
}

// --- what there is to say of each kind of member ------------------------------------------------------------------------

bool acts(double value) { return value != 0.0; }
bool acts(Round rounds) { return rounds != 0; }
bool acts(const Jitter& jitter) { return jitter.kind != Jitter::Kind::none; }
bool acts(const Matrix& matrix) { return matrix.size() > 0; }
template <class Effect>
bool acts(const std::optional<Effect>& effect) {
  return effect.has_value();
}

bool same(const auto& a, const auto& b) { return a == b; }
bool same(const Matrix& a, const Matrix& b) { return a.rows() == b.rows() && a.cols() == b.cols() && a == b; }

Matrix numbers_of(double value) { return Matrix::Constant(1, 1, value); }
Matrix numbers_of(const Matrix& matrix) { return matrix; }
Matrix numbers_of(const Jitter& jitter) { return Eigen::Vector3d(static_cast<double>(jitter.kind), jitter.mean, jitter.spread); }
template <class Effect>
Matrix numbers_of(const std::optional<Effect>& effect) {
  std::vector<double> numbers;
  Effect::fields([&](const LinkKey&, auto... member) { (numbers.push_back(static_cast<double>((*effect).*member)), ...); });
  return Eigen::Map<const Vector>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

// --- and back -------------------------------------------------------------------------------------------------------------

void set_number(double& to, double number, std::string_view) { to = number; }
void set_number(std::uint32_t& to, double number, std::string_view name) {
  if (!(number >= 0.0 && number <= std::numeric_limits<std::uint32_t>::max() && number == std::floor(number)))
    throw ConfigError(joined("a link's ", name, ' ', number, "; allowed: whole numbers"));
  to = static_cast<std::uint32_t>(number);
}

void require_count(std::string_view name, const Matrix& numbers, Eigen::Index count) {
  if (numbers.size() != count)
    throw ConfigError(
        joined("a link's ", name, " of ", counted(static_cast<std::uint64_t>(numbers.size()), "number"), "; allowed: ", count));
}

template <class Number>
void set_from(Number& to, const Matrix& numbers, std::string_view name) {
  require_count(name, numbers, 1);
  set_number(to, numbers(0), name);
}
void set_from(Matrix& to, const Matrix& numbers, std::string_view) { to = numbers; }
void set_from(Jitter& to, const Matrix& numbers, std::string_view name) {
  require_count(name, numbers, 3);
  std::uint32_t kind = 0;
  set_number(kind, numbers(0), name);
  if (kind > static_cast<std::uint32_t>(Jitter::Kind::normal))
    throw ConfigError(joined("a link's jitter of kind ", kind, "; allowed: 0 to 3"));
  to = {static_cast<Jitter::Kind>(kind), numbers(1), numbers(2)};
}
template <class Effect>
void set_from(std::optional<Effect>& to, const Matrix& numbers, std::string_view name) {
  to.emplace();
  require_count(name, numbers, numbers_of(to).size());
  Eigen::Index at = 0;
  Effect::fields([&](const LinkKey&, auto... member) { (set_number((*to).*member, numbers(at++), name), ...); });
}

// --- what is wrong --------------------------------------------------------------------------------------------------------

using Objection = std::optional<std::string>;

Objection beyond(const std::string& name, const LinkKey& key, double number) {
  if (std::isfinite(number) && number >= key.least && number <= key.most) return std::nullopt;
  const std::string allowed = key.most < kNoBound     ? joined(key.least, " to ", key.most)
                              : key.least > -kNoBound ? joined("from ", key.least, " on")
                                                      : "a finite number";
  return joined(name, ' ', number, "; allowed: ", allowed);
}

Objection objection_to(const LinkKey& key, double number) { return beyond(std::string(key.name), key, number); }
Objection objection_to(const LinkKey&, const Matrix&) { return std::nullopt; }
Objection objection_to(const LinkKey& key, const Jitter& jitter) {
  if (auto found = beyond("mean delay in rounds", key, jitter.mean)) return found;
  if (auto found = beyond("spread of the delay in rounds", key, jitter.spread)) return found;
  if (jitter.kind == Jitter::Kind::uniform && jitter.spread != std::floor(jitter.spread))
    return joined("spread of the uniform delay in rounds ", jitter.spread, "; allowed: a whole number");
  return std::nullopt;
}
template <class Effect>
Objection objection_to(const LinkKey& effect, const std::optional<Effect>& value) {
  if (!value) return std::nullopt;
  Objection found;
  Effect::fields([&](const LinkKey& key, auto... member) {
    const std::string name = joined(effect.name, ": ", key.name);
    ((found = found ? found : beyond(name, key, static_cast<double>((*value).*member))), ...);
  });
  return found ? found : value->objection();
}

// --- in words -------------------------------------------------------------------------------------------------------------

std::string words_for(const LinkKey& key, double number) { return joined(key.of_loss ? "loss" : key.name, ' ', number); }
std::string words_for(const LinkKey&, const Matrix& covariance) {
  if (covariance.size() == 1) return joined("noise covariance ", covariance(0));
  return joined("noise covariance ", covariance.cols() == 1 ? "diagonal" : "matrix", " of ", covariance.rows(), " x ", covariance.rows());
}
template <class Effect>
std::string words_for(const LinkKey&, const std::optional<Effect>& effect) {
  return effect->words();
}

std::string delay_text(const LinkSpec& link) {
  const Jitter& jitter = link.jitter;
  switch (jitter.kind) {
    case Jitter::Kind::none:
      return "delay " + counted(link.delay_rounds, "round");
    case Jitter::Kind::uniform:
      return joined("delay ", link.delay_rounds, " to ", link.delay_rounds + jitter.spread, " rounds");
    case Jitter::Kind::exponential:
      return joined("delay ", link.delay_rounds, " + exponential(", jitter.mean, ") rounds");
    case Jitter::Kind::normal:
      return joined("delay normal(", jitter.mean, ", ", jitter.spread, ") rounds");
  }
  return {};
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

std::optional<std::string> BurstLoss::objection() const {
  if (good_to_bad + bad_to_good > 0.0) return std::nullopt;
  return "a link that never changes between good and bad; allowed: at least one of the two probabilities above 0";
}

std::optional<std::string> DistanceLoss::objection() const {
  if (safe < lost) return std::nullopt;
  return joined("loss over the distances [", safe, ", ", lost, "]; allowed: two distances, ascending");
}

std::optional<std::string> Quantiser::objection() const {
  if (low < high && std::isfinite(high - low)) return std::nullopt;
  return joined("quantisation over [", low, ", ", high, "]; allowed: two numbers, ascending");
}

std::string BurstLoss::words() const {
  return joined(std::setprecision(3), "loss ", mean_loss(), " in bursts of ", mean_burst(), ' ', noun(mean_burst(), "message"),
                " (Gilbert-Elliott)");
}

std::string DistanceLoss::words() const { return joined("loss growing from distance ", safe, " to ", lost); }

std::string Reordering::words() const { return joined("reordering ", probability, " by ", counted(later_rounds, "round")); }

std::string Quantiser::words() const { return joined(counted(bits, "bit"), " over [", low, ", ", high, "]"); }

bool LinkSpec::operator==(const LinkSpec& other) const {
  bool all = true;
  fields([&](const LinkKey&, auto member) { all = all && same(this->*member, other.*member); });
  return all;
}

bool LinkSpec::ideal() const {
  bool any = false;
  fields([&](const LinkKey&, auto member) { any = any || acts(this->*member); });
  return !any;
}

bool LinkSpec::loses() const {
  bool any = false;
  fields([&](const LinkKey& key, auto member) { any = any || (key.of_loss && acts(this->*member)); });
  return any;
}

std::optional<std::string> objection(const LinkSpec& spec) {
  Objection found;
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    if (!found) found = objection_to(key, spec.*member);
  });
  return found;
}

std::string words_of(const LinkSpec& link) {
  std::string text;
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    std::string part;
    if constexpr (std::is_same_v<decltype(member), Jitter LinkSpec::*>)
      part = link.delay_rounds > 0 || acts(link.jitter) ? delay_text(link) : "";
    else if constexpr (!std::is_same_v<decltype(member), Round LinkSpec::*>)
      part = acts(link.*member) ? words_for(key, link.*member) : "";
    if (!part.empty()) text += (text.empty() ? "" : ", ") + part;
  });
  return text.empty() ? "ideal" : text;
}

Values values_of(const LinkSpec& link) {
  Values out;
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    if (acts(link.*member)) out.set(key.name, numbers_of(link.*member));
  });
  return out;
}

LinkSpec link_of(const Values& values) {
  LinkSpec out;
  std::vector<std::string_view> known;
  LinkSpec::fields([&](const LinkKey& key, auto member) {
    known.push_back(key.name);
    if (const Matrix* numbers = values.find(key.name)) set_from(out.*member, *numbers, key.name);
  });
  for (const Values::Entry& entry : values.entries())
    if (std::find(known.begin(), known.end(), entry.name) == known.end())
      throw ConfigError("a link: " + unknown_word("effect", entry.name, known));
  if (const auto found = objection(out)) throw ConfigError("a link's " + *found);
  return out;
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

}  // namespace consort
