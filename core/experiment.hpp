#pragma once
/// The experiment as pure values: what the file says, with every name resolved and every number in its place.

#include "core/network/link.hpp"
#include "core/network/schedule.hpp"
#include "core/stop.hpp"
#include "core/values.hpp"

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace consort {

enum class Mode { simulate, lockstep, realtime };
constexpr std::string_view name_of(Mode mode) {
  return mode == Mode::simulate ? "simulate" : mode == Mode::lockstep ? "lockstep" : "realtime";
}
enum class Discovery { automatic, multicast, neighbours };
/// What an agent's death that nobody planned does to the run.
enum class AgentLoss { abort, go_on };

/// What the record holds beside estimates, where the file says so.
struct Recording {
  std::optional<bool> state;   ///< what else protocols say is worth recording; nullopt: as much as kRecordedNumbers
  std::optional<bool> graphs;  ///< the graph of each segment; nullopt: up to a number of edges
};

/// A number source for a per-agent quantity. A file has been read into a list by then.
struct PerAgent {
  struct Same {
    Matrix value;
  };  ///< every agent the same
  struct List {
    std::vector<Matrix> values;
  };  ///< one entry per agent
  /// Agent i of n: first + (last - first)(i - 1)/(n - 1) in every component.
  struct Linspace {
    double first = 0, last = 1;
    std::size_t dimension = 1;
  };
  struct Uniform {
    double low = 0, high = 1;
    std::size_t dimension = 1;
  };  ///< keyed by (seed, "initial <name>", agent, component)
  std::variant<Same, List, Linspace, Uniform> source;
  [[nodiscard]] Matrix of(AgentId agent, std::size_t agents, std::string_view name, Seed seed) const;
};

struct NamedPerAgent {
  std::string name;
  PerAgent values;
};

/// A protocol with its parameters. Several in one experiment are run one after the other on the same draws.
struct ProtocolChoice {
  std::string name;
  Values parameters;
  /// Of a sweep: what is different from the experiment.
  struct Variant {
    std::size_t number = 0;  ///< 0, 1, ... of the sweep's values
    std::string label;       ///< usable in the name of a metric
    LinkModel links;
    std::optional<double> value = {};  ///< as a number, a duration in s; nullopt: it is not one
  };
  std::optional<Variant> variant = {};
  /// Its name in tables and before metrics.
  [[nodiscard]] std::string title() const { return variant ? name + "." + variant->label : name; }
  /// False for all but the first of a sweep's values.
  [[nodiscard]] bool first() const { return !variant || variant->number == 0; }
};

/// What differs for one agent.
struct AgentOverride {
  Values initial;
  Values parameters;
};

/// A signal that disturbs the plant, held over whole rounds. Amplitudes are scalars (every component alike) or one number per component.
struct Disturbance {
  enum class On { state, input, measurement };
  /// Zero mean, covariance as expand_covariance() takes it: of each held sample, or, as an `intensity`, of continuous-time white noise
  /// (unit^2 s), which is scaled by the time it is held: over h, N(0, W / h) per sample and N(0, W h) per state increment.
  struct Gaussian {
    Matrix covariance;
    bool intensity = false;
  };
  struct Uniform {
    Matrix bound;  ///< in [-bound, bound)
  };
  struct Sinusoid {
    PerAgent amplitude;
    double frequency = 1.0;  ///< rad/s
    PerAgent phase;          ///< rad, at t = 0
  };
  struct Constant {
    PerAgent value;
  };
  On on = On::measurement;
  std::variant<Gaussian, Uniform, Sinusoid, Constant> signal;
  Round hold_rounds = 1;
  std::vector<AgentId> agents;  ///< ascending; empty: all
  Round first = 0;              ///< it acts from this round on
};

/// The physics between actuation and measurement.
struct PlantSpec {
  enum class Sensing {
    own,         ///< an agent measures its own subsystem
    neighbours,  ///< and those of everybody who may ever be its in-neighbour: y_i = (y_ii, y_ij, ...), j ascending
    relative     ///< the outputs of those named in `relative` minus its own, j ascending; then, if it is `absolute`, minus its own
  };
  /// What agent edge.from does to the part of agent edge.to: named matrices, such as A and C.
  struct Coupling {
    Edge edge;
    Values values;
  };
  std::string model;
  Values parameters;
  std::vector<NamedPerAgent> initial;
  std::map<AgentId, AgentOverride> overrides;
  std::vector<Coupling> couplings;
  Sensing sensing = Sensing::own;
  std::map<AgentId, std::vector<AgentId>> relative;  ///< by measuring agent: whom it measures, ascending
  std::vector<AgentId> absolute;                     ///< who measures against the origin, ascending
  std::vector<Disturbance> disturbances;
  [[nodiscard]] Values initial_of(AgentId agent, std::size_t agents, Seed run_seed) const;
  /// Couplings among them, under the names A_2, C_2, ... for what agent 2 does.
  [[nodiscard]] Values parameters_of(AgentId agent) const;
};

/// How messages travel between processes.
struct Transport {
  double loss = 0.0;  ///< share of all packets that every process throws away before they are sent: real loss, on discovery and control too
  Seconds silence =
      5.0;  ///< after so long without a sign of life a process is dead that nobody here has started, and so is its orchestrator
  // Of Information, Measurement and Actuation in mode realtime:
  bool reliable = false;
  std::uint32_t history = 1;            ///< samples kept per sender
  std::optional<Seconds> lifespan;      ///< how long a message may be used; nullopt: one dt
  std::optional<Seconds> dds_deadline;  ///< after so long without a sample DDS says so; nullopt: 3 dt
  Seconds liveliness_lease = 1.0;       ///< after so long without a sign of life a writer counts as dead
};

/// What happens to an agent's process from outside. To the algorithm, a kill is a leave and a restart a join (`presence` holds both), and
/// a process that stops for a while makes the others wait (lockstep) or miss its messages (realtime).
struct Fault {
  enum class Kind { kill, restart, stop, proceed };
  Round round = 0;
  AgentId agent;
  Kind kind = Kind::kill;
};

using TopologySpec = Schedule::Spec;

struct Experiment {
  std::string name;
  std::string description;  ///< header comment of the file
  Mode mode = Mode::lockstep;
  Seed seed;
  std::size_t runs = 1;  ///< Monte Carlo: seeds seed, seed+1, ..., metrics are means over the runs
  Round rounds = 100;
  Seconds dt = 1.0;  ///< length of a round in model time
  std::size_t agents = 0;
  std::vector<ProtocolChoice> protocols;  ///< at least one
  std::vector<NamedPerAgent> initial;
  std::map<AgentId, AgentOverride> overrides;
  TopologySpec topology;
  std::string topology_text;  ///< as the user would say it, e.g. "random_pairs(dwell 1..8)"
  std::vector<LinkEvent> link_events;
  std::map<AgentId, Attendance> presence;  ///< of agents that join or leave on the way; all others are there throughout
  std::vector<Fault> faults;               ///< ascending by round
  LinkModel links;
  std::string sweep_text;  ///< YAML of the sweep; empty: none
  std::string sweep_key;   ///< what is swept, such as links.loss
  std::optional<PlantSpec> plant;
  std::size_t agents_per_process = 1;
  AgentLoss on_agent_loss = AgentLoss::abort;
  std::optional<Convergence> convergence;
  Transport transport;
  Seconds deadline = 300.0;           ///< wall clock, for the whole run
  std::optional<Round> report_every;  ///< nullopt: chosen by report_interval()
  Recording recording;
  Discovery discovery = Discovery::automatic;
  std::vector<std::string> metrics;
  std::vector<std::string> criteria;
  std::string resolved_text;  ///< canonical text of the resolved experiment (YAML), kept with the results

  [[nodiscard]] const LinkModel& links_of(const ProtocolChoice& choice) const { return choice.variant ? choice.variant->links : links; }
  [[nodiscard]] Schedule schedule(Seed run_seed) const { return Schedule(agents, topology, link_events, run_seed, presence); }
  [[nodiscard]] Attendance presence_of(AgentId agent) const;
  /// Whose subsystems agent i measures: itself, then (sensing neighbours) everybody who may ever be its in-neighbour, ascending; with
  /// relative sensing, those it measures relative to itself.
  [[nodiscard]] std::vector<AgentId> sensed_by(AgentId agent, const Graph& support) const;
  /// The initial values of one agent: `initial`, with that agent's override on top.
  [[nodiscard]] Values initial_of(AgentId agent, Seed run_seed) const;
  /// The protocol's parameters for one agent: common ones, with that agent's override on top.
  [[nodiscard]] Values parameters_of(const ProtocolChoice& protocol, AgentId agent) const;
  /// Rounds between two reports: what the user said, else the smallest m with (rounds / m) * agents <= 100 000, but never longer than the
  /// run. Rounds 0, m, 2m, ... and the last are reported.
  [[nodiscard]] Round report_interval() const;
};

/// What happens to agents and their processes, as the file names it: join, leave, kill, restart, stop, continue. Ascending by round.
struct ProcessEvent {
  Round round = 0;
  const char* kind = "";
  AgentId agent;
};
std::vector<ProcessEvent> process_events(const Experiment& experiment);

}  // namespace consort
