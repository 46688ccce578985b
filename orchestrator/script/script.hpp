#pragma once
/// The experiment file: YAML in, Experiment out. Every mistake is a ConfigError with file:line:column, what was found, what is allowed, the
/// nearest match.

#include "core/experiment.hpp"
#include "orchestrator/script/hosts.hpp"
#include "orchestrator/script/study.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

namespace consort {

/// Of the experiment file: `format: 1` may stand in it. What a file of a newer format means is not known here.
inline constexpr std::uint64_t kFileFormat = 1;

/// So many numbers of one agent can be recorded side by side: SQLite allows 2000 columns.
inline constexpr std::size_t kMostRecorded = 1900;

/// What the command line sets on top of the file.
inline constexpr std::uint64_t kMostRounds = 1'000'000'000, kMostRuns = 1'000'000;

struct ScriptOverrides {
  std::optional<Mode> mode = {};
  std::optional<std::uint64_t> seed = {};
  std::optional<Round> rounds = {};
  std::optional<std::size_t> runs = {};
  std::optional<std::size_t> agents_per_process = {};
  std::optional<std::vector<Host>> hosts = {};
  std::vector<Setting> settings = {};  ///< keys of the file that are something else
  std::optional<Cell> cell = {};       ///< of a study: the criteria are not this cell's, and metrics they name in it are computed
};

/// `hosts`, if given, is told where the experiment is to run; without any, here. Of a study without a cell: the first one.
Experiment load_experiment(const std::filesystem::path& file, const ScriptOverrides& overrides = {}, std::vector<Host>* hosts = nullptr);
/// The text of an experiment file.
std::string experiment_text(const std::filesystem::path& file);
/// `name` stands for the file in messages; relative data files are found from `directory`.
Experiment parse_experiment(const std::string& text, const std::string& name, const std::filesystem::path& directory,
                            const ScriptOverrides& overrides = {}, std::vector<Host>* hosts = nullptr);

/// The JSON Schema of the experiment file, as shipped (experiments/experiment.schema.json), compiled in.
std::string_view experiment_schema();

}  // namespace consort
