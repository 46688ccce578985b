#include "core/trace.hpp"

#include "core/errors.hpp"

namespace consort {

void Trace::add(const RoundReport& report) {
  check(report.estimates.size() == agents * dimension, "Trace::add: the report needs agents x dimension estimates");
  check(report.hashes.size() == agents && report.counters.size() == agents,
        "Trace::add: the report needs one hash and one counter per agent");
  check(report.states.size() == agents * state_dimension && (state_dimension == 0 || report.state_hashes.size() == agents),
        "Trace::add: the report needs agents x state dimension states");
  check(report.recorded.size() == agents * recorded_dimension, "Trace::add: the report needs agents x recorded dimension numbers");
  check(rounds.empty() || rounds.back() < report.k, "Trace::add: reports come in ascending order of rounds");
  rounds.push_back(report.k);
  estimates.add(report.estimates, shelf.get());
  states.add(report.states, shelf.get());
  recorded.add(report.recorded, shelf.get());
  HistoryHash all;
  for (const std::uint64_t agent_hash : report.hashes) all.mix(agent_hash);
  for (const std::uint64_t state_hash : report.state_hashes) all.mix(state_hash);
  hash = all.value();
  totals = {};
  for (const AgentCounters& counters : report.counters) totals += counters;
  last_round = report.k;
}

std::optional<Trace::Place> Trace::place_of(std::string_view name) const {
  for (const bool beside : {false, true}) {
    std::size_t at = 0;
    for (const Field& field : (beside ? recorded_layout : estimate_layout).fields) {
      if (field.name == name) return Place{beside, at, field};
      at += field.size();
    }
  }
  return std::nullopt;
}

}  // namespace consort
