#pragma once
/// The rounds of the plant, in lockstep with the agents: measurements out, actuations in, one step. Knows no transport and no clock; the
/// same steps as simulate().

#include "core/network/sent_window.hpp"
#include "core/trace.hpp"
#include "idl/wire.hpp"
#include "models/physics.hpp"

#include <functional>
#include <vector>

namespace consort {

class PlantRounds {
 public:
  /// Hands the measurements of one process's agents to whatever carries them.
  using Send = std::function<void(std::uint32_t process, Round round, std::span<const double> values)>;

  /// Hands what the plant lacks to whatever carries it to the processes. Epoch and process are for the carrier to fill in.
  using Tell = std::function<void(Standing&&)>;

  /// `run` holds every agent. Throws ConfigError where the model or a disturbance refuses its values.
  PlantRounds(const PlantAssignment& run, Send send, Tell tell = {});

  /// Rounds below grant.until may run. A grant that came before, or an older one, changes nothing.
  void grant(const Grant& grant);
  /// Takes the controls of one process's agents. Throws RunError if they have another length than the plant takes.
  void receive(const Actuation& actuation);
  /// A process tells how far it has come and what it lacks: that is sent again.
  void answer(const Standing& standing);
  /// Tells which controls are lacking; false if none is.
  bool ask();
  /// How many controls have come that it can use.
  [[nodiscard]] std::uint64_t heard() const { return heard_; }
  /// How many of those that it had asked for have come once more: they were only late.
  [[nodiscard]] std::uint64_t came_twice() const { return came_twice_; }
  [[nodiscard]] std::uint64_t sent_again_bytes() const { return sent_again_bytes_; }
  /// These agents are gone: nobody waits for their actuation. Their parts stand still, and go on being reported.
  void depart(std::span<const AgentId> agents);
  /// Runs every round that can run now. Throws RunError naming agent, round and model where a state stops being finite.
  void advance();
  /// Real time: moves on to round k, whatever has been received, each control held as long as no newer one has come, and sends what is
  /// measured there.
  void begin_round(Round k);
  /// Real time: controls that had not come in time.
  [[nodiscard]] std::uint64_t missed_inputs() const { return missed_inputs_; }

  /// The grant's report point has been reached since reports were last collected.
  [[nodiscard]] bool report_due() const { return report_due_; }
  /// What has not been collected yet; `whole`: and how each part stands.
  std::vector<MemberReport> collect_reports(bool whole = false);
  [[nodiscard]] Round round() const { return physics_.round(); }
  [[nodiscard]] const Layout& state_layout() const { return physics_.state_layout(); }
  /// Lowest ids of the processes, ascending.
  [[nodiscard]] const std::vector<std::uint32_t>& processes() const { return names_; }
  /// The round from this one on in which somebody of that process next takes part; kNever if in none.
  [[nodiscard]] Round next(std::uint32_t process) const;
  /// One of the agents whose actuation the round waits for, and how many processes it still waits for; 0: it waits for a grant.
  struct Progress {
    AgentId agent;
    std::size_t missing = 0;
  };
  [[nodiscard]] Progress progress() const;

 private:
  struct Process {
    std::vector<AgentId> agents;  // ascending
    bool acted = false;           // its controls of the current round are there
    Round newest = 0;             // real time: the round its newest controls are of, plus one
    bool there = false;           // it took part in the round before
    Round reached = 0;            // its slowest agent has come as far
    std::uint32_t asked = 0;      // for its controls of `asked_of`, so often
    Round asked_of = 0;
    SentWindow sent;  // what it may still lack
  };
  [[nodiscard]] bool takes_part(const Process& process) const;
  [[nodiscard]] bool may_measure();
  void measure();
  void extend_histories();
  void add_report(std::size_t index);

  Physics physics_;
  Send send_;
  Tell tell_;
  Round rounds_, report_interval_, ahead_;
  bool steered_, realtime_;
  std::vector<Attendance> attendance_;          // by agent
  std::map<std::uint32_t, Process> processes_;  // by lowest agent id
  std::vector<std::uint32_t> names_;
  std::vector<MemberReport> reports_;  // by agent
  std::vector<HistoryHash> hashes_;
  std::vector<double> values_;  // of one process, being put together
  bool measured_ = false;       // this round's measurements are out
  std::size_t missing_ = 0;     // processes whose controls of this round are still to come
  Round until_ = 0, report_at_ = 0;
  bool report_due_ = false;
  std::uint64_t missed_inputs_ = 0, sent_again_bytes_ = 0, heard_ = 0, came_twice_ = 0;
};

}  // namespace consort
