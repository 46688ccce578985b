#pragma once
/// simulate(): the whole experiment in one thread and without a clock. The oracle of every other mode.

#include "core/trace.hpp"
#include "rounds/agent_maker.hpp"

#include <functional>

namespace consort {

/// Called for each reported round, in order; may be empty. Return false to end the run early (an interrupted user).
using ReportSink = std::function<bool(const RoundReport&)>;

/// Called for every agent as it is made, which takes time where there are many; may be empty, and may throw to end that.
using WhileMade = std::function<void()>;

/// About how many bytes simulate() takes for all agents of one run, each like `agent`; what the trace keeps is not among them.
double bytes_to_simulate(const Experiment& experiment, const ProtocolChoice& choice, const Protocol& agent);

/// Runs one protocol of the experiment with one seed. Exactly the rounds of docs/architecture.md.
/// Throws ConfigError (a protocol refuses its values) or RunError (an estimate became non-finite: names agent, round, protocol).
Trace simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink = {},
               const WhileMade& while_made = {});
/// The same into `trace`, whose shelf is used, and which holds what was known by then also when this throws: reports and links. Without
/// agents: it never began.
void simulate(const Experiment& experiment, const ProtocolChoice& protocol, Seed run_seed, const ReportSink& sink, Trace& trace,
              const WhileMade& while_made = {});
/// Runs a protocol that need not be in the table, such as entry<Mine>() of protocols/registry_entry.hpp; `experiment.protocols` is not
/// looked at.
Trace simulate(const Experiment& experiment, const ProtocolEntry& entry, const Values& parameters, Seed run_seed,
               const ReportSink& sink = {});

}  // namespace consort
