#pragma once
/// The columns of a record's table of estimates.

#include "core/experiment.hpp"
#include "core/layout.hpp"
#include "orchestrator/run/run.hpp"

#include <string>
#include <vector>

namespace consort {

/// A column of the table estimates.
struct RecordColumn {
  std::string name, kind;
  Field field;
  std::size_t row, column;
  std::string meaning;
};

/// What each agent of a protocol reports, in the order of its rows.
std::vector<RecordColumn> columns_of(const ProtocolChoice& choice, const Experiment& experiment, const Trace& outline);

}  // namespace consort
