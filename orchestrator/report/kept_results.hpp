#pragma once
/// What a results folder says of its runs, as plain values. Of a run that was killed: what is there.

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace consort {

struct KeptRun {
  std::int64_t run = 0;  ///< its number in the record
  std::string protocol;  ///< of a sweep, with the name of its value
  std::string seed;
  std::string hash;                    ///< over every round of every agent; empty: it did not end
  std::optional<std::int64_t> rounds;  ///< executed; nothing: it did not end
};

struct KeptCriterion {
  std::string text;
  std::optional<bool> met;  ///< nothing: the run is not complete
  double value = 0.0;       ///< NaN: not a number
};

struct KeptResults {
  std::filesystem::path folder;
  std::string text;             ///< the experiment, resolved, as YAML
  nlohmann::ordered_json host;  ///< host.json; null: it is not there
  std::vector<KeptRun> runs;
  std::map<std::string, double> metrics;  ///< NaN: not a number
  std::vector<KeptCriterion> criteria;
};

/// Throws ConfigError if `folder` holds no record of a format that tells all this, RunError if reading fails.
KeptResults kept_results(const std::filesystem::path& folder);

/// The file of a results folder that is its record. Throws ConfigError where there is none.
std::filesystem::path record_of(const std::filesystem::path& folder);

/// A JSON file, parsed; null where it is not there or is none.
nlohmann::ordered_json json_in(const std::filesystem::path& file);

}  // namespace consort
