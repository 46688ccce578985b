#pragma once
/// What a run leaves behind: estimates of the reported rounds and what is recorded beside them, a hash over all rounds, message counts.

#include "core/counters.hpp"
#include "core/layout.hpp"
#include "core/rows.hpp"
#include "core/types.hpp"

#include <bit>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

namespace consort {

/// Hash of one agent's whole history, extended round by round, so it covers rounds that are not reported too.
class HistoryHash {
 public:
  void extend(std::span<const double> estimate) {
    for (const double value : estimate) mix(std::bit_cast<std::uint64_t>(value));
  }
  void mix(std::uint64_t word) {
    state_ = (state_ ^ word) * 0x9E3779B97F4A7C15ULL;
    state_ ^= state_ >> 29;
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0x243F6A8885A308D3ULL;
};

/// What a protocol's estimate is an estimate of, where the plant knows the truth.
enum class Truth : std::uint8_t {
  none,      ///< nothing the plant has: agents agree, or steer
  state,     ///< the first numbers of the estimate are those of the agent's part of the plant
  everybody  ///< the first numbers are slots of equal length, agent after agent, one for the part of each; kAbsent: not estimated
};

/// How one process kept time, and what it used.
struct Performance {
  std::uint32_t process = 0;  ///< lowest agent id it hosts; 0: the plant
  std::uint64_t periods = 0, missed_deadlines = 0;
  std::uint64_t missed_inputs = 0;                               ///< measurements or actuations that had not come in time
  Seconds jitter_p50 = 0.0, jitter_p99 = 0.0, jitter_max = 0.0;  ///< wake-up after the planned instant
  Seconds cpu = 0.0;
  std::uint64_t resident_bytes = 0;    ///< at most
  std::uint64_t sent_again_bytes = 0;  ///< by DDS, since packets were lost
  std::uint64_t dds_deadlines_missed = 0, liveliness_lost = 0;
};

/// All agents at the beginning of round k (k = 0: the initial estimates), in agent order. The numbers of an agent that is not there are
/// kAbsent; its hash and its counters are those of the rounds it was there.
struct RoundReport {
  Round k = 0;
  std::span<const double> estimates;                 ///< n x dimension, agent after agent
  std::span<const std::uint64_t> hashes;             ///< n
  std::span<const AgentCounters> counters;           ///< n
  std::span<const double> states = {};               ///< n x state dimension: the true states of the plant; empty without a plant
  std::span<const std::uint64_t> state_hashes = {};  ///< n; empty without a plant
  std::span<const double> recorded = {};             ///< n x recorded dimension: what agents record beside their estimates
};

/// The reported rounds of one run, ascending, ending with the last round.
struct Trace {
  std::size_t agents = 0, dimension = 0;
  Layout estimate_layout;
  std::vector<Round> rounds;        ///< reported rounds, first 0
  Rows<double> estimates;           ///< by report: agents x dimension
  std::size_t state_dimension = 0;  ///< of an agent's part of the plant; 0 without a plant
  Layout state_layout;
  Rows<double> states;                 ///< by report: agents x state_dimension
  std::size_t recorded_dimension = 0;  ///< of what an agent records beside its estimate
  Layout recorded_layout;
  Rows<double> recorded;  ///< by report: agents x recorded_dimension
  Truth truth = Truth::none;
  bool agrees_on_states = false;  ///< the agents steer the plant: what they agree on is its states, not their estimates
  std::uint64_t hash = 0;         ///< over every round of every agent up to the last round
  Round last_round = 0;           ///< rounds executed
  bool converged = false;         ///< the stop rule's convergence held
  AgentCounters totals;
  std::vector<LinkTotals> links;       ///< links that carried anything, ascending by edge
  std::vector<NetworkTotals> network;  ///< mode realtime: the same links, ascending by edge
  std::vector<Performance> processes;  ///< of those that told it; none in simulate

  std::shared_ptr<Shelf> shelf;  ///< where reports go that are too many for memory; none: they stay there

  void add(const RoundReport& report);  ///< appends; recomputes hash, totals, last_round
  [[nodiscard]] std::span<const double> at(std::size_t report, AgentId agent) const {
    return estimates[report].subspan(index_of(agent) * dimension, dimension);
  }
  [[nodiscard]] std::span<const double> state_at(std::size_t report, AgentId agent) const {
    return states[report].subspan(index_of(agent) * state_dimension, state_dimension);
  }
  [[nodiscard]] std::span<const double> recorded_at(std::size_t report, AgentId agent) const {
    return recorded[report].subspan(index_of(agent) * recorded_dimension, recorded_dimension);
  }
  /// Where the numbers that agents record under a name lie: in their estimates, or beside them.
  struct Place {
    bool beside = false;
    std::size_t at = 0;
    Field field;
  };
  [[nodiscard]] std::optional<Place> place_of(std::string_view name) const;
  [[nodiscard]] std::span<const double> numbers(const Place& place, std::size_t report, AgentId agent) const {
    return (place.beside ? recorded_at(report, agent) : at(report, agent)).subspan(place.at, place.field.size());
  }
  /// What the agents are to agree on: agents x agreed_dimension() numbers of one report.
  [[nodiscard]] std::span<const double> agreed(const RoundReport& report) const {
    return agrees_on_states ? report.states : report.estimates;
  }
  [[nodiscard]] std::span<const double> agreed_at(std::size_t report) const { return (agrees_on_states ? states : estimates)[report]; }
  /// One report again, without hashes and counters.
  [[nodiscard]] RoundReport report(std::size_t number) const {
    return {rounds[number], estimates[number], {}, {}, states[number], {}, recorded[number]};
  }
  [[nodiscard]] std::size_t agreed_dimension() const { return agrees_on_states ? state_dimension : dimension; }
  [[nodiscard]] std::span<const double> final_estimate(AgentId agent) const { return at(rounds.size() - 1, agent); }
};

}  // namespace consort
