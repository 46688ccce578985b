#pragma once
/// Named numbers of the experiment file: one value, or one for every agent.

#include "core/experiment.hpp"
#include "core/value_doc.hpp"
#include "orchestrator/script/yaml.hpp"

#include <filesystem>

namespace consort::script {

/// A number for every agent: a number, a list, {all}, {linspace}, {uniform}, {file}. Files are found from `directory`.
std::optional<PerAgent> read_per_agent(Mistakes&, const YAML::Node&, const std::string& what, const std::filesystem::path& directory,
                                       std::size_t agents);

/// What `docs` say of the value `name`; null if nothing.
const ValueDoc* doc_of(std::span<const ValueDoc> docs, std::string_view name);

/// A parameter: a number, vector or matrix; a switch, or one of a choice's words, where `doc` says so. `doc` may be null.
std::optional<Matrix> read_value(Mistakes&, const ValueDoc* doc, const YAML::Node&, const std::string& what);

/// True if `key` is one of `names`; else a mistake with the nearest of them.
bool known(Mistakes&, const YAML::Node& key, const std::string& what, const std::vector<std::string>& names);

}  // namespace consort::script
