#pragma once
/// The lists of `consort list` as the project's own pages hold them, and as the JSON Schema of the experiment file does. Tests compare both
/// with the files.

#include <string>
#include <string_view>
#include <vector>

namespace consort {

/// The names of all that is in the list protocols, plants, topologies or metrics.
std::vector<std::string> names_in(std::string_view list);

/// Protocols, plants, topologies or metrics in Markdown, lines of at most 120 characters.
std::string markdown_of(std::string_view what);

/// The definitions of experiments/experiment.schema.json that speak of protocols and models, as they stand there: their names, their
/// parameters' names, and the words of choices.
std::string schema_of_tables();

}  // namespace consort
