#pragma once
/// The plant of one run: a model with its state, its clock and what disturbs it. simulate() and the plant process drive the same object.

#include "core/gaussian.hpp"
#include "core/plant_task.hpp"
#include "models/model.hpp"

#include <memory>

namespace consort {

class Physics {
 public:
  /// Throws ConfigError where the model refuses its values or a disturbance does not fit (naming agent and disturbance).
  explicit Physics(const PlantTask& task);

  [[nodiscard]] std::size_t agents() const { return parts_.size(); }
  [[nodiscard]] std::size_t control_size(AgentId i) const { return part(i).m; }
  [[nodiscard]] std::size_t measurement_size(AgentId i) const { return part(i).p; }
  /// How many agents' distances agent i is told.
  [[nodiscard]] std::size_t distance_count(AgentId i) const { return part(i).distances.size(); }
  /// How far those are away from it in the round that the state is in: Euclidean, between the parts of the states named position.
  void distances(AgentId i, std::span<double> out) const;
  /// Names of the numbers of one agent's state, as reports carry it: those of the largest part.
  [[nodiscard]] const Layout& state_layout() const { return model_->state_layout(largest_); }
  [[nodiscard]] const Layout& state_layout(AgentId i) const { return model_->state_layout(i); }
  /// One state that every agent observes.
  [[nodiscard]] bool shared() const { return model_->shared(); }
  /// What agent i may know: the model's matrices and, where it senses others, `sensed`: whose outputs y_i holds, in order. With relative
  /// sensing: `relative`, whom it measures relative to itself, and `absolute` (1), missing where there is nobody or no origin.
  [[nodiscard]] Values knowledge(AgentId i) const;
  /// Agent i is gone from the current round on: its part stands still, its control is zero, and it acts on nobody.
  void depart(AgentId i);
  [[nodiscard]] bool present(AgentId i, Round k) const { return part(i).presence.holds(k); }

  /// The round from now on in which agent i next takes part; kNever if in none.
  [[nodiscard]] Round next(AgentId i) const { return part(i).presence.next(k_); }

  /// y_i(k) of the round that the state is in. What it would measure of an agent that is absent is kAbsent (relative sensing).
  void measure(AgentId i, std::span<double> y) const;
  /// Where u_i of the round goes before advance(); zero where nothing was written.
  [[nodiscard]] std::span<double> control(AgentId i) { return std::span(controls_).subspan(part(i).u, part(i).m); }
  /// From x(k) to x(k + 1), u held. Throws RunError naming agent, round and model when a state is no longer finite.
  void advance();
  [[nodiscard]] Round round() const { return k_; }
  [[nodiscard]] std::span<const double> state(AgentId i) const { return std::span(state_).subspan(part(i).x, part(i).n); }
  /// The state of agent i as reports carry it, state_layout().size() numbers: those that a smaller part lacks are kAbsent.
  void report_state(AgentId i, std::span<double> out) const;

 private:
  /// A signal ready to use.
  struct Source {
    Disturbance::On on;
    Signal::Kind kind;
    std::uint32_t number;
    Round hold_rounds, first;
    double frequency;
    Vector amplitude, phase;  // one per component
    Gaussian noise;
    bool increment = false;  // white noise on the state: added to it after the step, not held
  };
  struct Part {
    std::size_t x, n, u, m, p;  // where state and control lie, and their lengths; length of the measurement
    std::vector<AgentId> sensed;
    bool relative, absolute;
    Attendance presence;
    std::vector<Source> sources;
    std::vector<AgentId> distances;
    std::size_t position = 0, position_size = 0;  // within its state
  };

  [[nodiscard]] const Part& part(AgentId i) const { return parts_.at(index_of(i)); }
  [[nodiscard]] Source source_of(AgentId i, const Signal& signal, std::size_t size) const;
  void add(AgentId i, const Source& source, std::span<double> to) const;
  void add_all(AgentId i, Disturbance::On on, bool increments, std::span<double> to) const;
  void update_presence();
  void find_position(AgentId i, Part& part) const;
  void measure_relative(AgentId i, std::span<double> y) const;

  std::string name_;
  std::shared_ptr<const PlantModel> model_;
  Seed seed_;
  Seconds dt_;
  std::vector<Part> parts_;
  std::vector<double> state_, controls_, disturbances_, inputs_;
  std::vector<char> active_;  // by agent: it takes part in round k_
  AgentId largest_;           // whose part has most states
  Round k_ = 0;
};

}  // namespace consort
