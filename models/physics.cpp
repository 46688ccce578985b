#include "models/physics.hpp"

#include "core/errors.hpp"
#include "models/registry.hpp"

#include <algorithm>
#include <cmath>
#include <set>

namespace consort {
namespace {

constexpr Purpose kDisturbance{"plant disturbance"};

std::string place(AgentId agent, std::uint32_t number) {
  return "plant.disturbances[" + std::to_string(number) + "], agent " + std::to_string(agent.value);
}

// One number per component from a scalar or a vector.
Vector per_component(const Matrix& given, std::size_t size, const std::string& what) {
  const auto n = static_cast<Eigen::Index>(size);
  if (given.size() == 1) return Vector::Constant(n, given(0, 0));
  if (given.cols() == 1 && given.rows() == n) return given.col(0);
  throw ConfigError(what + ": found " + std::to_string(given.rows()) + " x " + std::to_string(given.cols()) +
                    "; allowed: one number or one per component, " + std::to_string(size));
}

// A_2 is the coupling A of agent 2: the name of the coupling, or the name itself where it is none.
std::string_view coupling_of(std::string_view name, std::span<const ValueDoc> couplings) {
  const std::string_view base = name.substr(0, name.rfind('_'));
  const bool known = std::any_of(couplings.begin(), couplings.end(), [&](const ValueDoc& doc) { return doc.name == base; });
  return known ? base : name;
}

}  // namespace

Physics::Physics(const PlantTask& task) : name_(task.model), seed_(task.seed), dt_(task.dt) {
  PlantSetup setup{task.parts.size(), task.dt, {}, {}};
  const PlantEntry& entry = find_plant(task.model);
  for (const PlantPart& given : task.parts) {
    Values own, couplings;
    for (const Values::Entry& value : given.parameters.entries()) {
      const std::string_view base = coupling_of(value.name, entry.couplings);
      (base == value.name ? own : couplings).set(base, value.value);
    }
    require_known("plant model " + task.model, "parameter", own, entry.parameters);
    require_known("plant model " + task.model, "initial value", given.initial, entry.initial);
    setup.parameters.push_back(given.parameters);
    setup.initial.push_back(given.initial);
  }
  model_ = entry.make(setup);
  const bool asks_distances =
      std::any_of(task.parts.begin(), task.parts.end(), [](const PlantPart& any) { return !any.distances.empty(); });
  std::set<std::uint32_t> state_disturbed;  // by which disturbances so far
  for (std::size_t index = 0; index < task.parts.size(); ++index) {
    const AgentId i = agent_at(index);
    const PlantPart& given = task.parts[index];
    Part part{model_->shared() ? 0 : state_.size(),
              model_->state_layout(i).size(),
              controls_.size(),
              model_->control_size(i),
              0,
              given.sensed,
              given.relative,
              given.absolute,
              given.presence,
              {},
              given.distances};
    if (asks_distances) find_position(i, part);
    if (index == 0 || part.n > parts_[index_of(largest_)].n) largest_ = i;
    if (index == 0 || !model_->shared()) {
      const Vector x = model_->initial_state(i);
      state_.insert(state_.end(), x.begin(), x.end());
    }
    controls_.resize(controls_.size() + part.m);
    for (const AgentId j : part.sensed) part.p += model_->output_size(j);
    if (part.absolute) part.p += model_->output_size(i);
    for (const AgentId j : part.sensed)
      if (part.relative && model_->output_size(j) != model_->output_size(i))
        throw ConfigError("plant.sensing: agent " + std::to_string(i.value) + " cannot measure agent " + std::to_string(j.value) +
                          " relative to itself: their outputs have other lengths; allowed: equal ones");
    for (const Signal& signal : given.signals) {
      // The one state of all is disturbed once, by the first agent the disturbance names.
      if (model_->shared() && signal.on == Disturbance::On::state && !state_disturbed.insert(signal.number).second) continue;
      const std::size_t size = signal.on == Disturbance::On::state ? part.n : signal.on == Disturbance::On::input ? part.m : part.p;
      part.sources.push_back(source_of(i, signal, size));
    }
    parts_.push_back(std::move(part));
  }
  disturbances_.resize(state_.size());
  inputs_.resize(controls_.size());
  active_.resize(parts_.size());
  update_presence();
}

void Physics::find_position(AgentId i, Part& part) const {
  std::size_t at = 0;
  for (const Field& field : model_->state_layout(i).fields) {
    if (field.name == "position") {
      part.position = at;
      part.position_size = field.size();
    }
    at += field.size();
  }
  const bool alike = parts_.empty() || parts_.front().position_size == part.position_size;
  if (part.position_size == 0 || !alike || model_->shared())
    throw ConfigError("links.loss.distance: found the plant model " + name_ + ", in which agent " + std::to_string(i.value) + " has " +
                      (alike ? "no position" : "a position of another dimension") +
                      "; allowed: a plant whose agents' states have a part named position");
}

void Physics::distances(AgentId i, std::span<double> out) const {
  const Part& own = part(i);
  for (std::size_t d = 0; d < own.distances.size(); ++d) {
    const Part& other = part(own.distances[d]);
    double squares = 0.0;
    for (std::size_t c = 0; c < own.position_size; ++c) {
      const double apart = state_[own.x + own.position + c] - state_[other.x + other.position + c];
      squares += apart * apart;
    }
    out[d] = std::sqrt(squares);
  }
}

void Physics::depart(AgentId i) {
  Attendance& presence = parts_.at(index_of(i)).presence;
  presence.cut(k_);
  const std::span<double> u = control(i);
  std::fill(u.begin(), u.end(), 0.0);
  update_presence();
}

void Physics::update_presence() {
  for (std::size_t index = 0; index < parts_.size(); ++index) active_[index] = present(agent_at(index), k_) ? 1 : 0;
}

Values Physics::knowledge(AgentId i) const {
  Values known = model_->knowledge(i);
  const auto& sensed = part(i).sensed;
  if (part(i).absolute) known.set("absolute", 1.0);
  if (sensed.size() > 1 || (part(i).relative && !sensed.empty())) {
    Vector ids(static_cast<Eigen::Index>(sensed.size()));
    for (std::size_t s = 0; s < sensed.size(); ++s) ids[static_cast<Eigen::Index>(s)] = sensed[s].value;
    known.set(part(i).relative ? "relative" : "sensed", ids);
  }
  return known;
}

Physics::Source Physics::source_of(AgentId i, const Signal& signal, std::size_t size) const {
  const std::string what = place(i, signal.number);
  Source source{signal.on, signal.kind, signal.number, signal.hold_rounds, signal.first, signal.frequency, {}, {}, {}};
  const auto n = static_cast<Eigen::Index>(size);
  switch (signal.kind) {
    case Signal::Kind::gaussian:
      source.noise = Gaussian(expand_covariance(signal.amplitude, n, what));
      break;
    case Signal::Kind::intensity: {
      // White noise of intensity W: N(0, W / h) per sample held over h; on the state, the increment of one step is drawn exactly.
      const Matrix intensity = expand_covariance(signal.amplitude, n, what);
      source.increment = signal.on == Disturbance::On::state && signal.hold_rounds == 1;
      source.noise = Gaussian(source.increment ? model_->increment_covariance(i, intensity)
                                               : Matrix(intensity / (dt_ * static_cast<double>(signal.hold_rounds))));
      break;
    }
    case Signal::Kind::sinusoid:
      source.phase = per_component(signal.phase, size, what + ", phase");
      [[fallthrough]];
    case Signal::Kind::uniform:
    case Signal::Kind::constant:
      source.amplitude = per_component(signal.amplitude, size, what);
      break;
  }
  return source;
}

void Physics::add(AgentId i, const Source& source, std::span<double> to) const {
  const Round held = k_ / source.hold_rounds;
  switch (source.kind) {
    case Signal::Kind::gaussian:
    case Signal::Kind::intensity:
      source.noise.add(seed_.stream(kDisturbance, source.number, i.value, held), to);
      return;
    case Signal::Kind::uniform: {
      Stream stream = seed_.stream(kDisturbance, source.number, i.value, held);
      for (std::size_t c = 0; c < to.size(); ++c) {
        const double bound = source.amplitude[static_cast<Eigen::Index>(c)];
        to[c] += stream.uniform(-bound, bound);
      }
      return;
    }
    case Signal::Kind::sinusoid: {
      const double t = static_cast<double>(held * source.hold_rounds) * dt_;
      for (std::size_t c = 0; c < to.size(); ++c) {
        const auto at = static_cast<Eigen::Index>(c);
        to[c] += source.amplitude[at] * std::sin(source.frequency * t + source.phase[at]);
      }
      return;
    }
    case Signal::Kind::constant:
      for (std::size_t c = 0; c < to.size(); ++c) to[c] += source.amplitude[static_cast<Eigen::Index>(c)];
      return;
  }
}

void Physics::add_all(AgentId i, Disturbance::On on, bool increments, std::span<double> to) const {
  for (const Source& source : part(i).sources)
    if (source.on == on && source.increment == increments && k_ >= source.first) add(i, source, to);
}

// y_i = (x_j - x_i, ...; -x_i) in the outputs of the model.
void Physics::measure_relative(AgentId i, std::span<double> y) const {
  const double t = static_cast<double>(k_) * dt_;
  const std::size_t size = model_->output_size(i);
  std::vector<double> own(size);
  model_->output(i, t, {state_, active_}, own);
  std::size_t at = 0;
  for (const AgentId j : part(i).sensed) {
    model_->output(j, t, {state_, active_}, y.subspan(at, size));
    for (std::size_t c = 0; c < size; ++c) y[at + c] -= own[c];
    at += size;
  }
  if (part(i).absolute) std::transform(own.begin(), own.end(), y.begin() + static_cast<std::ptrdiff_t>(at), std::negate<>());
  add_all(i, Disturbance::On::measurement, false, y);
  for (std::size_t s = 0; s < part(i).sensed.size(); ++s)
    if (active_[index_of(part(i).sensed[s])] == 0) std::fill_n(y.begin() + static_cast<std::ptrdiff_t>(s * size), size, kAbsent);
}

void Physics::measure(AgentId i, std::span<double> y) const {
  if (part(i).relative) return measure_relative(i, y);
  const double t = static_cast<double>(k_) * dt_;
  std::size_t at = 0;
  for (const AgentId j : part(i).sensed) {
    const std::size_t size = model_->output_size(j);
    model_->output(j, t, {state_, active_}, y.subspan(at, size));
    at += size;
  }
  add_all(i, Disturbance::On::measurement, false, y);
}

void Physics::advance() {
  inputs_ = controls_;
  std::fill(disturbances_.begin(), disturbances_.end(), 0.0);
  for (std::size_t index = 0; index < parts_.size(); ++index) {
    const AgentId i = agent_at(index);
    if (parts_[index].sources.empty()) continue;
    add_all(i, Disturbance::On::input, false, std::span(inputs_).subspan(parts_[index].u, parts_[index].m));
    add_all(i, Disturbance::On::state, false, std::span(disturbances_).subspan(parts_[index].x, parts_[index].n));
  }
  model_->advance(static_cast<double>(k_) * dt_, {inputs_, disturbances_, active_}, state_);
  for (std::size_t index = 0; index < parts_.size(); ++index) {
    const std::span<double> x = std::span(state_).subspan(parts_[index].x, parts_[index].n);
    if ((active_[index] != 0 || shared()) && !parts_[index].sources.empty()) add_all(agent_at(index), Disturbance::On::state, true, x);
    if (!std::all_of(x.begin(), x.end(), [](double value) { return std::isfinite(value); })) {
      throw RunError("plant model " + name_ + ": agent " + std::to_string(index + 1) + ", round " + std::to_string(k_) +
                     ": the state is no longer finite; the loop is unstable, or the step (dt) is too long for it");
    }
  }
  ++k_;
  update_presence();
  std::fill(controls_.begin(), controls_.end(), 0.0);
}

void Physics::report_state(AgentId i, std::span<double> out) const {
  const std::span<const double> x = state(i);
  std::fill(std::copy(x.begin(), x.end(), out.begin()), out.end(), kAbsent);
}

}  // namespace consort
