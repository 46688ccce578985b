#pragma once
/// One page of a run, or of several side by side: a single HTML file that needs no network and no other file.

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

/// What the page shows of one output folder. Throws ConfigError where it holds no record, RunError if reading fails.
nlohmann::ordered_json page_data(const std::filesystem::path& folder);

/// The whole page. `live`: it asks the server that it comes from for what is new.
std::string page_of(const std::vector<std::filesystem::path>& folders, bool live = false);

}  // namespace consort
