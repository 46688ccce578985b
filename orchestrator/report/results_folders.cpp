#include "orchestrator/report/results_folders.hpp"

#include "core/errors.hpp"
#include "core/number_text.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "orchestrator/report/sqlite.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace consort {
namespace {

// SQLite keeps a lock on the shared memory of a log while a connection is open, also of another process.
bool somebody_has_it_open(const std::filesystem::path& record) {
  const int file = ::open((record.string() + "-shm").c_str(), O_RDWR | O_CLOEXEC);
  if (file < 0) return false;
  struct flock lock {};
  lock.l_type = F_WRLCK;
  lock.l_whence = SEEK_SET;
  const bool open = ::fcntl(file, F_GETLK, &lock) == 0 && lock.l_type != F_UNLCK;
  ::close(file);
  return open;
}

std::uintmax_t bytes_in(const std::filesystem::path& folder) {
  std::uintmax_t sum = 0;
  std::error_code ignored;  // a run may make and remove files meanwhile
  for (std::filesystem::recursive_directory_iterator at(folder, ignored), end; at != end; at.increment(ignored))
    if (at->is_regular_file(ignored) && !at->is_symlink(ignored)) {
      const std::uintmax_t size = at->file_size(ignored);
      if (!ignored) sum += size;
    }
  return sum;
}

std::string word_of(const Statement& experiment, bool open, bool criteria) {
  if (experiment.is_null(5)) return open ? "running" : "killed";
  switch (static_cast<Exit>(experiment.integer(5))) {
    case Exit::ok:
      return criteria ? "passed" : "done";
    case Exit::criterion_not_met:
      return "not met";
    case Exit::timed_out:
      return "timed out";
    case Exit::interrupted:
    case Exit::terminated:
      return "interrupted";
    default:
      return "failed";
  }
}

std::time_t seconds_of(const std::string& utc) {
  std::tm time{};
  return ::strptime(utc.c_str(), "%Y-%m-%dT%H:%M:%S", &time) == nullptr ? 0 : ::timegm(&time);
}

bool is_left_by_a_run(const std::string& name) {
  static constexpr std::array names{"experiment.yaml",
                                    "host.json",
                                    "summary.json",
                                    "theory.json",
                                    "record.sqlite",
                                    "record.sqlite-wal",
                                    "record.sqlite-shm",
                                    "record.sqlite-journal",
                                    "report.html",
                                    "plan.json",
                                    "cells",
                                    "table.csv",
                                    "table.tex",
                                    "table.md",
                                    "logs",
                                    "csv",
                                    "json",
                                    "mat",
                                    "graphml"};
  return std::find(names.begin(), names.end(), name) != names.end() || name.ends_with(".part");
}

}  // namespace

bool is_results_folder(const std::filesystem::path& folder) {
  std::error_code ignored;
  const auto record = folder / "record.sqlite";
  if (std::filesystem::is_symlink(folder, ignored) || !std::filesystem::is_regular_file(std::filesystem::symlink_status(record, ignored)))
    return false;
  try {
    Database database(record, Database::Open::read);
    static_cast<void>(record_format(database, record.string()));
    return true;
  } catch (const std::runtime_error&) {  // a file of that name, but no record
    return false;
  }
}

ResultsFolder describe(const std::filesystem::path& folder) {
  if (!is_results_folder(folder))
    throw ConfigError(fmt::format("{}: is no results folder; allowed: an output folder of `consort run`", folder.string()));
  const auto record = folder / "record.sqlite";
  ResultsFolder found;
  found.path = folder;
  found.bytes = bytes_in(folder);
  const bool open = somebody_has_it_open(record);  // before this process has it open
  Database database(record, Database::Open::read);
  if (record_format(database, record.string()) < 2) {  // it does not say
    found.experiment = folder.filename().string();
    found.verdict = "format 1";
    return found;
  }
  Statement row = database.prepare("SELECT name, mode, seed, runs, agents, exit, began, (SELECT count(*) FROM criteria) FROM experiment");
  if (!row.step()) {
    found.verdict = open ? "running" : "killed";
    return found;
  }
  found.experiment = row.text(0);
  found.mode = row.text(1);
  found.seed = row.text(2);
  found.runs = row.integer(3);
  found.agents = row.integer(4);
  found.verdict = word_of(row, open, row.integer(7) > 0);
  found.began = row.text(6);
  return found;
}

std::vector<ResultsFolder> results_below(const std::filesystem::path& base) {
  std::error_code failure;
  if (!std::filesystem::is_directory(base, failure))
    throw ConfigError(fmt::format("{}: is no folder; allowed: a folder that holds results, or one of them", base.string()));
  std::vector<ResultsFolder> found;
  if (is_results_folder(base)) {
    found.push_back(describe(base));
    return found;
  }
  for (std::filesystem::recursive_directory_iterator at(base, std::filesystem::directory_options::skip_permission_denied, failure), end;
       at != end && !failure; at.increment(failure)) {
    if (!at->is_directory(failure) || at->is_symlink(failure)) continue;
    if (!is_results_folder(at->path())) continue;
    at.disable_recursion_pending();
    found.push_back(describe(at->path().lexically_normal()));
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return std::tie(a.began, a.path) < std::tie(b.began, b.path); });
  return found;
}

std::vector<ResultsFolder> to_prune(std::span<const ResultsFolder> all, std::time_t now, std::optional<double> age,
                                    std::optional<std::size_t> keep) {
  std::vector<ResultsFolder> chosen;
  std::map<std::string, std::size_t> newer;
  for (std::size_t i = all.size(); i-- > 0;) {
    const ResultsFolder& folder = all[i];
    const bool spared = keep && newer[folder.experiment]++ < *keep;
    const bool young = age && std::difftime(now, seconds_of(folder.began)) <= *age;
    if (!spared && !young && !folder.running()) chosen.push_back(folder);
  }
  std::reverse(chosen.begin(), chosen.end());
  return chosen;
}

double parse_age(const std::string& option, const std::string& text) {
  static const std::map<std::string_view, double> units{{"min", 60.0}, {"h", 3600.0}, {"d", 86400.0}, {"w", 604800.0}};
  const std::size_t end = std::min(text.find_first_not_of("0123456789."), text.size());
  std::string_view unit = std::string_view(text).substr(end);
  unit.remove_prefix(std::min(unit.find_first_not_of(' '), unit.size()));
  const auto amount = parse_number<double>(std::string_view(text).substr(0, end));
  if (!amount || !units.contains(unit))
    throw ConfigError(fmt::format("{}: found '{}'; allowed: a number and min, h, d or w, as 30d", option, text));
  return *amount * units.at(unit);
}

std::vector<std::string> strange_entries(const std::filesystem::path& folder) {
  std::vector<std::string> strange;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!is_left_by_a_run(name)) strange.push_back(name);
  }
  std::sort(strange.begin(), strange.end());
  return strange;
}

void remove_results(const std::filesystem::path& folder) {
  if (describe(folder).running()) throw ConfigError(fmt::format("{}: is not deleted, as its run goes on", folder.string()));
  if (const auto strange = strange_entries(folder); !strange.empty())
    throw ConfigError(fmt::format("{}: is not deleted, as it holds {}, which no run leaves there; allowed: results alone", folder.string(),
                                  strange.front()));
  std::error_code failure;
  std::filesystem::remove_all(folder, failure);
  if (failure) throw RunError(fmt::format("cannot delete {}: {}", folder.string(), failure.message()));
}

std::string bytes_text(std::uintmax_t bytes) {
  auto amount = static_cast<double>(bytes);
  std::size_t unit = 0;
  static constexpr std::array units{"B", "kB", "MB", "GB", "TB"};
  while (amount >= 999.5 && unit + 1 < units.size()) {
    amount /= 1000.0;
    ++unit;
  }
  return unit == 0 || amount >= 99.5 ? fmt::format("{:.0f} {}", amount, units.at(unit)) : fmt::format("{:.3g} {}", amount, units.at(unit));
}

}  // namespace consort
