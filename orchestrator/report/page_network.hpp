#pragma once
/// What a page shows of the network of a run: drawings of its graphs with what theory says of them, and what became of the messages.

#include "orchestrator/report/sqlite.hpp"

#include <nlohmann/json.hpp>

namespace consort {

/// {agents, places: [[x, y], ...], segments: [{from, to, edges: [[sender, receiver, weight], ...], facts}], of}; null where the record has
/// no graphs or there are more than 200 agents. At most 20 segments are drawn; `of` says how many there are.
nlohmann::ordered_json page_graphs(Database& database, std::int64_t run, std::size_t agents);

/// {totals: {...}, worst: [{sender, receiver, delivered, lost, ...}, ...], network: [...], agents: [...]} of one run.
nlohmann::ordered_json page_messages(Database& database, std::int64_t run);

}  // namespace consort
