#pragma once
/// The results folders of this disk: what each holds, and which may go.

#include <cstdint>
#include <ctime>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace consort {

struct ResultsFolder {
  std::filesystem::path path;
  std::string experiment, mode, seed;
  std::string verdict;  ///< a word: passed, done, not met, failed, ...; running: somebody has its record open; killed: nobody ended it
  std::string began;    ///< UTC, ISO 8601; empty: not known
  std::int64_t runs = 0, agents = 0;
  std::uintmax_t bytes = 0;
  [[nodiscard]] bool running() const { return verdict == "running"; }
};

/// Holds it the record of a run?
bool is_results_folder(const std::filesystem::path& folder);
/// What there is to say of one. Throws ConfigError if it is none.
ResultsFolder describe(const std::filesystem::path& folder);
/// All below `base`, itself among them; oldest first. Links are not followed. Throws ConfigError if there is no such folder.
std::vector<ResultsFolder> results_below(const std::filesystem::path& base);

/// Which of them go: older than `age` seconds, and not among the `keep` newest of their experiment; what is not asked for spares none.
/// None that runs. Pure.
std::vector<ResultsFolder> to_prune(std::span<const ResultsFolder> all, std::time_t now, std::optional<double> age,
                                    std::optional<std::size_t> keep);
/// 90 min, 12 h, 30 d, 4 w as seconds. Throws ConfigError that begins with `option`.
double parse_age(const std::string& option, const std::string& text);

/// What lies in a results folder that no run leaves there.
std::vector<std::string> strange_entries(const std::filesystem::path& folder);
/// Deletes it. Throws ConfigError if it is no results folder, runs, or holds anything that no run leaves; RunError if that fails.
void remove_results(const std::filesystem::path& folder);

std::string bytes_text(std::uintmax_t bytes);  ///< 1.2 MB

}  // namespace consort
