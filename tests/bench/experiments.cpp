/// `make experiments`: every shipped experiment in full, in both modes; a table of criteria, values and times.

#include "tests/bench/command.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace {

using namespace consort::bench;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr double kLimitSeconds = 3600.0;

struct Run {
  json summary;  ///< what `consort run --json` printed; null if it printed none
  int exit_code = -1;
  double seconds = 0.0;
};

Run run(const std::string& consort, const fs::path& file, const std::string& mode, const fs::path& output) {
  const auto begin = std::chrono::steady_clock::now();
  const Outcome outcome =
      run_command({consort, "run", file.string(), "--mode", mode, "--json", "--quiet", "--output", (output / mode / file.stem()).string()},
                  kLimitSeconds);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return {json::parse(outcome.output, nullptr, false), outcome.exit_code, seconds};
}

std::string number(const json& value) { return value.is_number() ? fmt::format("{:.6g}", value.get<double>()) : "-"; }

/// One experiment in both modes: a line for the runs, a line per criterion. True if all went well and both gave the same trace.
bool show(const std::string& consort, const fs::path& file, const fs::path& output) {
  fmt::print(stderr, "{} ...\n", file.stem().string());
  const Run simulated = run(consort, file, "simulate", output), processes = run(consort, file, "lockstep", output);
  if (simulated.summary.is_discarded() || processes.summary.is_discarded()) {
    fmt::print("{:<30} no summary: exit codes {} (simulate), {} (lockstep)\n", file.stem().string(), simulated.exit_code,
               processes.exit_code);
    return false;
  }
  const bool same = simulated.summary["trace_hash"] == processes.summary["trace_hash"];
  const bool passed = simulated.exit_code == 0 && processes.exit_code == 0;
  fmt::print("{:<30} {}  {} rounds  simulate {:.2f} s  lockstep {:.1f} s ({:.0f} rounds/s)  traces {}\n", file.stem().string(),
             passed ? "PASSED" : "FAILED", processes.summary["rounds"].get<std::uint64_t>(), simulated.seconds, processes.seconds,
             processes.summary["performance"]["rounds_per_second"].get<double>(), same ? "equal" : "DIFFER");
  const json &ours = simulated.summary["criteria"], &theirs = processes.summary["criteria"];
  for (std::size_t c = 0; c < ours.size() && c < theirs.size(); ++c) {
    fmt::print("    {} {:<60} {:>14} {:>14}\n", ours[c]["met"] == true && theirs[c]["met"] == true ? "met   " : "FAILED",
               ours[c]["text"].get<std::string>(), number(ours[c]["value"]), number(theirs[c]["value"]));
  }
  std::fflush(stdout);
  return passed && same;
}

}  // namespace

int main(int argc, char** argv) {
  std::string consort, experiments;
  CLI::App app(
      "Runs every experiment of a folder in full, in both modes, and prints its criteria, their values (simulate, lockstep) and times.");
  app.add_option("--consort", consort, "the consort program")->required()->check(CLI::ExistingFile);
  app.add_option("--experiments", experiments, "folder of experiments")->required()->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(experiments))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  std::string folder = (fs::temp_directory_path() / "consort-experiments-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) {
    fmt::print(stderr, "cannot create a folder in {}\n", fs::temp_directory_path().string());
    return 3;
  }
  std::size_t failed = 0;
  for (const fs::path& file : files) failed += show(consort, file, folder) ? 0 : 1;
  fs::remove_all(folder);
  fmt::print("\n{} of {} experiments passed in both modes with equal traces\n", files.size() - failed, files.size());
  return failed == 0 ? 0 : 1;
}
