#include "core/errors.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/child_runs.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/signals.hpp"
#include "orchestrator/cli/study.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/comparison.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/study_page.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>

namespace consort {
namespace {

const char* const kTolerance =
    "How far a metric may be from A's: 0.01, or 5% of it; of one metric, as bias=0.01, or of all that begin alike, as 'error*=5%'. Of "
    "several the last that fits counts. With any, metrics and criteria alone decide.";

std::vector<Tolerance> tolerances_in(const std::vector<std::string>& texts) {
  std::vector<Tolerance> tolerances;
  for (const std::string& text : texts) tolerances.push_back(parse_tolerance("--tolerance", text));
  return tolerances;
}

// Two results folders are held against each other; what came of it decides the exit code.
class ComparingVerb : public Verb {
 public:
  using Verb::Verb;

 protected:
  void add_options() {
    app_.add_option("--tolerance", tolerance_texts_, kTolerance)->type_name("[METRIC=]T")->allow_extra_args(false);
    add_output_flags("Print the comparison as JSON: every run, every metric, every key that differs.",
                     "Print nothing: the exit code says whether they are equal.");
  }
  [[nodiscard]] std::vector<Tolerance> tolerances() const { return tolerances_in(tolerance_texts_); }
  Exit conclude(const Comparison& comparison) const {
    show(render(comparison, style_of(STDOUT_FILENO)),
         to_json(comparison).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    return comparison.equal() ? Exit::ok : Exit::criterion_not_met;
  }
  [[nodiscard]] bool json() const { return json_; }
  [[nodiscard]] bool quiet() const { return quiet_; }

 private:
  std::vector<std::string> tolerance_texts_;
};

class DiffVerb : public ComparingVerb {
 public:
  explicit DiffVerb(CLI::App& parent) : ComparingVerb(*parent.add_subcommand("diff", "")) {
    document(app_,
             "compare two runs by what they left\n"
             "Reads the results folders A and B and says whether their runs are equal bit for bit, and else which reported round, agent "
             "and number is the first to differ; how far each metric is from A's; which criteria are judged otherwise; and which keys of "
             "the experiment, the host and the versions were different. Runs belong together by protocol and seed.",
             {{"consort diff results/ring-20250131-194500 results/ring-20250131-195212", "Are they equal, and where do they part?"},
              {"consort diff old new --tolerance 1% --tolerance rmse=0.02", "Is anything worse than a little?"}},
             {{"0", "equal (with tolerances: every metric within them, every criterion judged alike)"},
              {"1", "different"},
              {"2", "a folder holds no record"},
              {"3", "reading failed"}});
    app_.add_option("a", a_, "The output folder of a run.")->required()->type_name("A");
    app_.add_option("b", b_, "Another one.")->required()->type_name("B");
    add_options();
  }

  Exit execute() override { return conclude(compare_folders(a_, b_, tolerances())); }

 private:
  std::string a_, b_;
};

class ReplayVerb : public ComparingVerb {
 public:
  explicit ReplayVerb(CLI::App& parent) : ComparingVerb(*parent.add_subcommand("replay", "")) {
    document(app_,
             "repeat a run from its results, and compare\n"
             "Runs the experiment that DIR keeps once more, with its seed, mode and all else that it says, and compares as `consort diff` "
             "does: A is DIR, B the new results. A simulated or lockstep run of the same version gives the same bits. Of a study every "
             "cell is run again.",
             {{"consort replay results/ring-20250131-194500", "Does it give the same today?"},
              {"consort replay results/ring-20250131-194500 --mode simulate", "Does it give the same without processes?"},
              {"consort replay results/ring-20250131-194500 --tolerance 1%", "Has a new version changed more than a little?"}},
             {{"0", "equal (with tolerances: every metric within them, every criterion judged alike)"},
              {"1", "different"},
              {"2", "DIR holds no record, or its experiment cannot be run"},
              {"3", "the run could not be started, or reading failed"},
              {"130, 143", "interrupted by SIGINT, SIGTERM"}});
    app_.add_option("folder", folder_, "The output folder of a run.")->required()->type_name("DIR");
    app_.add_option("--mode", mode_, "Repeat it in this mode: simulate, lockstep, realtime. Default: the one it had.")
        ->type_name("MODE")
        ->check(one_of({"simulate", "lockstep", "realtime"}));
    app_.add_option("--output", output_, "Folder for the new results, absent or empty. Default: results/<experiment>-<time>.")
        ->type_name("DIR");
    add_options();
  }

  Exit execute() override {
    const auto tolerated = tolerances();
    const KeptResults kept = kept_results(folder_);
    const std::filesystem::path output = make_output();
    const std::vector<std::vector<std::string>> command{is_study_folder(folder_) ? study_arguments(output) : arguments(kept, output)};
    ChildAnswer answer;
    const int signal = run_children(command, {1, quiet() || json()}, [&](std::size_t, const ChildAnswer& said) { answer = said; });
    if (signal != 0) return interrupted_exit(signal);
    if (!std::filesystem::exists(output / "record.sqlite"))
      throw ConfigError(fmt::format("{}: cannot be repeated: {}", folder_, answer.err.empty() ? "see above" : answer.err));
    return conclude(compare_folders(folder_, output, tolerated));
  }

 private:
  [[nodiscard]] std::filesystem::path make_output() const {
    if (output_.empty()) {
      const auto name = std::filesystem::weakly_canonical(folder_).filename().string();
      return create_results_folder("results", "replay-of-" + name, std::time(nullptr));
    }
    claim_output_folder(output_);
    return output_;
  }

  // The same study, planned anew in `output`; it is resumed there before anything of it is done.
  [[nodiscard]] std::vector<std::string> study_arguments(const std::filesystem::path& output) const {
    StudyAsked asked = plan_in(folder_).asked;
    if (!mode_.empty()) asked.overrides.mode = mode_ == "simulate" ? Mode::simulate : mode_ == "lockstep" ? Mode::lockstep : Mode::realtime;
    const auto file = std::filesystem::path(folder_) / "experiment.yaml";
    const std::string text = experiment_text(file);
    begin_study(output, text, make_plan(text, file.string(), asked), {"consort", "replay", folder_});
    std::vector<std::string> words{"run", "--resume", output.string()};
    if (quiet() || json()) words.emplace_back("--quiet");
    return words;
  }

  // As it was started, but for what is of one run alone: its name, domain, where its results went, who was started by hand.
  [[nodiscard]] std::vector<std::string> arguments(const KeptResults& kept, const std::filesystem::path& output) const {
    std::vector<std::string> words{"run", (std::filesystem::path(folder_) / "experiment.yaml").string(), "--output", output.string()};
    if (!mode_.empty()) words.insert(words.end(), {"--mode", mode_});
    if (quiet() || json()) words.emplace_back("--quiet");
    const std::vector<std::string> line = kept.host.is_object() ? kept.host.value("command_line", words) : std::vector<std::string>{};
    for (std::size_t i = 0; i < line.size(); ++i) {
      if (line[i] == "--force" || line[i].starts_with("--interface=")) words.push_back(line[i]);
      if (line[i] == "--interface" && i + 1 < line.size()) words.insert(words.end(), {line[i], line[i + 1]});
    }
    return words;
  }

  std::string folder_, mode_, output_;
};

}  // namespace

std::unique_ptr<Verb> make_diff_verb(CLI::App& parent) { return std::make_unique<DiffVerb>(parent); }
std::unique_ptr<Verb> make_replay_verb(CLI::App& parent) { return std::make_unique<ReplayVerb>(parent); }

}  // namespace consort
