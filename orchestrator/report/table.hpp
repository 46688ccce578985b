#pragma once
/// The table at the end of a run, for people.

#include "orchestrator/report/results.hpp"
#include "orchestrator/report/terminal.hpp"

#include <string>

namespace consort {

/// Protocols side by side as far as `style.width` allows, the rest below; mean ± standard deviation over several runs; the first numbers
/// of vectors; the criteria; where the results are.
std::string render(const Summary& summary, const TextStyle& style);

}  // namespace consort
