#include "core/errors.hpp"
#include "core/option_text.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/child_runs.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/signals.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/tested.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <set>
#include <utility>

namespace consort {
namespace {

bool is_experiment(const std::filesystem::path& file) { return file.extension() == ".yaml" || file.extension() == ".yml"; }

// The files that are named, and those in the folders that are, ascending.
std::vector<std::filesystem::path> experiments_in(const std::vector<std::string>& paths) {
  std::vector<std::filesystem::path> files;
  for (const std::string& path : paths) {
    if (!std::filesystem::is_directory(path)) {
      files.emplace_back(path);
      continue;
    }
    const std::size_t before = files.size();
    for (const auto& entry : std::filesystem::recursive_directory_iterator(path))
      if (entry.is_regular_file() && is_experiment(entry.path())) files.push_back(entry.path());
    if (files.size() == before)
      throw ConfigError(fmt::format("{}: holds no experiment; allowed: a file, or a folder that holds .yaml files", path));
    std::sort(files.begin() + static_cast<std::ptrdiff_t>(before), files.end());
  }
  return files;
}

// A folder for the results of each: its name without .yaml; of several alike the later ones have a number.
std::vector<std::string> names_of(const std::vector<std::filesystem::path>& files) {
  std::vector<std::string> names;
  std::set<std::string> taken;
  for (const auto& file : files) {
    const std::string stem = file.stem().string();
    std::string name = stem;
    for (int number = 2; !taken.insert(name).second; ++number) name = fmt::format("{}-{}", stem, number);
    names.push_back(name);
  }
  return names;
}

class TestVerb : public Verb {
 public:
  explicit TestVerb(CLI::App& parent) : Verb(*parent.add_subcommand("test", "")) {
    document(
        app_,
        "run experiments as tests\n"
        "Runs each FILE, and every .yaml file in each folder, and reports as tests do: that it ran to its end is a case, and so is each "
        "of its criteria. With --baseline each is also compared with earlier results, as `consort diff` does. The results are kept, "
        "a folder an experiment, and can be the next baseline.",
        {{"consort test experiments --mode simulate --junit report.xml", "What a continuous-integration server reads."},
         {"consort test experiments --output baseline", "Results to compare with later."},
         {"consort test experiments --baseline baseline --tolerance 1%", "Has anything changed by more than a hundredth?"}},
        {{"0", "every case passed"},
         {"1", "a criterion was not met, or a baseline is left"},
         {"2, 3, 4", "a run ended so: the first that did decides"},
         {"130, 143", "interrupted by SIGINT, SIGTERM; what had ended is in the report"}});
    app_.add_option("paths", paths_, "Experiments (YAML), or folders of them.")->required()->type_name("FILE|DIR");
    app_.add_option("--junit", junit_, "Write a JUnit report.")->type_name("FILE");
    app_.add_option_function<std::string>(
            "--jobs", [this](const std::string& text) { jobs_ = whole_option<std::size_t>("--jobs", text, 1, 1000); },
            "Experiments to run at once. Simulations use every core anyhow; processes that keep time disturb each other. Default: 1.")
        ->type_name("N");
    app_.add_option("--mode", mode_, "Run all in this mode: simulate, lockstep, realtime. Default: each file's.")
        ->type_name("MODE")
        ->check(one_of({"simulate", "lockstep", "realtime"}));
    app_.add_option("--output", output_, "Folder for the results, absent or empty. Default: results/test-<time>.")->type_name("DIR");
    app_.add_option("--baseline", baseline_,
                    "What `consort test --output` left earlier: the results of each experiment are compared with it.")
        ->type_name("DIR");
    app_.add_option("--tolerance", tolerances_,
                    "How far a metric may be from the baseline's, as for `consort diff`. Without any, the results are to be equal bit for "
                    "bit.")
        ->type_name("[METRIC=]T")
        ->allow_extra_args(false);
    add_output_flags("Print the cases as JSON.", "Print nothing: exit code and report say it all.");
  }

  Exit execute() override {
    std::vector<Tolerance> tolerances;
    for (const std::string& text : tolerances_) tolerances.push_back(parse_tolerance("--tolerance", text));
    if (!tolerances_.empty() && baseline_.empty()) throw ConfigError("--tolerance: found no --baseline that it is of; allowed: both");
    if (!baseline_.empty() && !std::filesystem::is_directory(baseline_))
      throw ConfigError(fmt::format("--baseline {}: is no folder; allowed: what `consort test --output` left", baseline_));
    const auto files = experiments_in(paths_);
    const auto names = names_of(files);
    const std::filesystem::path base = make_output();
    std::vector<std::vector<std::string>> commands;
    for (std::size_t i = 0; i < files.size(); ++i) {
      std::vector<std::string> words{"run", files[i].string(), "--no-report", "--output", (base / names[i]).string()};
      if (!mode_.empty()) words.insert(words.end(), {"--mode", mode_});
      commands.push_back(std::move(words));
    }
    const TextStyle style = style_of(STDOUT_FILENO);
    std::vector<TestedExperiment> all(files.size());
    const int signal = run_children(commands, {jobs_, true}, [&](std::size_t i, const ChildAnswer& answer) {
      all[i] = tested(files[i].string(), base / names[i], answer);
      if (!baseline_.empty() && answer.exit <= static_cast<int>(Exit::criterion_not_met))
        all[i].cases.push_back(against_baseline(names[i], base / names[i], tolerances));
      show(render(all[i], style), "");
    });
    std::erase_if(all, [](const TestedExperiment& tested) { return tested.cases.empty(); });  // those that a signal kept from running
    if (!junit_.empty()) write_file(junit_, junit(all));
    show("\n" + render_totals(all, style) + fmt::format("  {}\n", base.string()),
         to_json(all).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return signal != 0 ? interrupted_exit(signal) : verdict(all);
  }

 private:
  [[nodiscard]] std::filesystem::path make_output() const {
    if (output_.empty()) return create_results_folder("results", "test", std::time(nullptr));
    claim_output_folder(output_);
    return output_;
  }

  static TestedExperiment tested(const std::string& name, const std::filesystem::path& results, const ChildAnswer& answer) {
    TestedExperiment test{
        name,        fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::time(nullptr) - static_cast<long>(answer.seconds))),
        answer.exit, answer.out,
        answer.err,  {}};
    add_cases(test, answer.seconds, json_in(results / "summary.json"));
    return test;
  }

  [[nodiscard]] TestCase against_baseline(const std::string& name, const std::filesystem::path& results,
                                          std::span<const Tolerance> tolerances) const {
    try {
      return baseline_case(compare_folders(std::filesystem::path(baseline_) / name, results, tolerances));
    } catch (const std::runtime_error& failure) {  // one experiment without a baseline costs no other its report
      return {"as the baseline", TestCase::Outcome::failed, failure.what()};
    }
  }

  static Exit verdict(const std::vector<TestedExperiment>& all) {
    bool failed = false;
    for (const TestedExperiment& tested : all) {
      if (tested.count(TestCase::Outcome::error) > 0)
        return tested.exit > static_cast<int>(Exit::criterion_not_met) && tested.exit <= static_cast<int>(Exit::timed_out)
                   ? static_cast<Exit>(tested.exit)
                   : Exit::run_failed;
      failed = failed || tested.count(TestCase::Outcome::passed) < tested.cases.size();
    }
    return failed ? Exit::criterion_not_met : Exit::ok;
  }

  std::vector<std::string> paths_, tolerances_;
  std::string junit_, mode_, output_, baseline_;
  std::size_t jobs_ = 1;
};

}  // namespace

std::unique_ptr<Verb> make_test_verb(CLI::App& parent) { return std::make_unique<TestVerb>(parent); }

}  // namespace consort
