#pragma once
/// What the parts of a run tell each other, as plain values: what is to be run, leave to run, and what was sent, measured, done and
/// reported. How it travels is no matter here.

#include "core/network/announcements.hpp"
#include "core/network/link.hpp"
#include "core/plant_task.hpp"
#include "core/trace.hpp"

#include <algorithm>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// What one agent is told at the start of a run.
struct MemberTask {
  AgentId agent;
  std::uint32_t process = 0;  ///< lowest id among the agents hosted together with it
  Values initial;
  Values parameters;                            ///< on top of the common ones
  bool hears_everyone = false;                  ///< every other agent may be an in-neighbour
  std::vector<AgentId> in_neighbours;           ///< else: everyone who may ever be one, ascending
  std::uint32_t remote_readers = 0;             ///< processes other than its own that read it from its first round on
  std::vector<Round> late_readers;              ///< when a further process begins to, ascending
  std::vector<LinkModel::Change> link_changes;  ///< of its in-links, ascending; an exception is a change in round 0
  Values model;                                 ///< what it knows of its own dynamics; empty without a plant
  std::uint32_t measurements = 0;               ///< length of y_i; 0 without a plant
  std::uint32_t distances = 0;                  ///< numbers that follow it: how far its in-neighbours are away; 0: its links do not ask
  std::vector<Told> told;                       ///< whose announcement reaches it, ascending by agent
  Attendance presence;
};

/// Half a grant window is never longer, in rounds (nor shorter than a report interval).
constexpr Round kLargestHalfWindow = 512;
/// Nobody is ever granted more rounds beyond the slowest agent: so much is kept for later by who is ahead and by who hears of it.
constexpr Round largest_window(Round report_interval) { return 2 * std::max(kLargestHalfWindow, report_interval) + report_interval; }

/// How many rounds a sender may begin beyond those who hear it, where each of them hears at most `senders` in other processes, in messages
/// of `numbers`: what waits for a process that is not looking fits into the buffer that Linux gives its socket unasked.
constexpr Round rounds_ahead(std::size_t senders, std::size_t numbers) {
  constexpr double kBuffer = 2.0e5;                                                 // bytes, half of net.core.rmem_default as it comes
  const double packet = 512.0 + 2.0 * (80.0 + 8.0 * static_cast<double>(numbers));  // what the kernel counts for it
  const double fit = kBuffer / (packet * static_cast<double>(std::max<std::size_t>(senders, 1)));
  return static_cast<Round>(std::clamp(fit, 2.0, static_cast<double>(kLargestHalfWindow)));
}

/// How samples are delivered in real time. In lockstep what is lost is asked for again (Standing).
struct Delivery {
  bool reliable = false;
  std::uint32_t history = 1;
  Seconds lifespan = 1.0;  ///< how long a message may be used
  Seconds deadline = 1.0, liveliness_lease = 1.0;
};

/// One part of a run's assignment; part p of `parts` holds some of the members.
struct Assignment {
  std::uint32_t part = 0, parts = 1, epoch = 0;
  Seed seed;
  std::string protocol;
  std::uint32_t agents = 0;
  Seconds dt = 1.0;
  Round rounds = 0, report_interval = 1, window = 1;
  Round ahead = kLargestHalfWindow;  ///< lockstep: nobody begins more rounds than this beyond those who hear it
  Values parameters;
  LinkSpec standard_link;
  std::vector<LinkModel::Change> link_changes;  ///< of that one, ascending
  std::uint32_t largest_state = 0;              ///< n_j of the largest part of the plant; 0 without one
  std::uint32_t largest_control = 0;            ///< length of the longest u of any agent; 0 without a plant
  bool relays = false;                          ///< what others announced is passed on to whoever reads an agent
  bool steers = false;                          ///< the plant waits for every agent's actuation
  bool plant = false;                           ///< there is a plant: whoever measures waits for it
  bool realtime = false;                        ///< the wall clock paces the rounds
  bool tells_links = false;                     ///< a process may be gone before its last words: each report says how its links stand
  Delivery delivery;
  std::optional<bool> recorded = {};  ///< all or nothing of what is worth recording beside estimates; nullopt: what fits
  std::map<AgentId, Round> joining;   ///< agents that are not there, and when they join: nobody waits to meet them before
  std::vector<MemberTask> members;
};

/// One part of what the plant is told; part p of `parts` holds some of the agents, ascending.
struct PlantAssignment {
  std::uint32_t part = 0, parts = 1, epoch = 0;
  Round rounds = 0, report_interval = 1;
  Round ahead = kLargestHalfWindow;  ///< as that of an Assignment
  bool steered = false;
  bool realtime = false;
  Delivery delivery;
  PlantTask task;                         ///< `parts` of the agents named by `agents`, in that order
  std::vector<AgentId> agents;            ///< ascending
  std::vector<std::uint32_t> process_of;  ///< by position in `agents`: lowest id among the agents hosted together with it
};

/// The graph of the rounds from `first` on, by number; stated once.
struct GrantedSegment {
  Round first = 0;
  std::uint32_t graph = 0;
  std::optional<std::vector<WeightedEdge>> stated;
};

struct Grant {
  std::uint32_t epoch = 0;
  Round until = 0, report_at = 0;
  std::vector<GrantedSegment> segments;
  std::uint64_t start_ns = 0;  ///< realtime: wall clock of round 0; the segments are then all that hold from the current round on
  bool whole = false;          ///< the report at report_at says how each agent stands, and its links
  Round reached = 0;           ///< lockstep: everybody who is there has come as far: no message of a round before it is lacking
};

/// A view: `values` is valid during the call it is handed to.
struct Information {
  std::uint32_t epoch = 0;
  AgentId sender;
  Round round = 0;
  std::span<const double> values;
};

/// Lockstep: one process tells those it hears how far it has come, and what has not come to it. Any of them may be lost, or come twice.
struct Standing {
  /// Messages of these rounds from that agent; from the plant if it is nobody; from the agents of that process if the plant asks.
  struct Gap {
    AgentId sender;
    Round first = 0, rounds = 1;
    std::uint32_t asked = 0;  ///< so often before: who has sent again more often has answered already
  };
  std::uint32_t epoch = 0, process = 0;  ///< process 0: the plant
  Round slowest = 0;                     ///< round of its slowest agent
  std::map<AgentId, Round> readers;      ///< of its agents: the round that each has come to
  std::vector<Gap> gaps;
};

struct Layouts {
  AgentId agent;
  std::uint32_t epoch = 0;
  Layout message, estimate;
  Values announcement = {};
  Layout recorded = {};  ///< what its reports hold beside the estimate
};

/// Views: `values` is valid during the call it is handed to.
struct Measurement {
  std::uint32_t epoch = 0;
  Round round = 0;
  std::span<const double> values;
};
struct Actuation {
  std::uint32_t epoch = 0, process = 0;
  Round round = 0;
  std::span<const double> values;
};

struct MemberReport {
  AgentId agent;
  std::vector<Round> rounds;
  std::vector<double> estimates;
  std::vector<std::uint64_t> hashes;
  std::vector<AgentCounters> counters;
  std::vector<double> recorded = {};  ///< what is recorded beside the estimates
  std::uint64_t slept = 0;            ///< real time: rounds of this stay that it has left out so far
};

}  // namespace consort
