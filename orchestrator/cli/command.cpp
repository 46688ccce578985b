#include "core/build.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/terminal.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <sstream>

namespace consort {

void say(const std::string& text) {
  const TextStyle style = style_of(STDERR_FILENO);
  streams::tell(fmt::format("{} {}\n", toned("consort:", Tone::bad, style), text));
}

namespace {

std::string refusal_json(Exit exit, const std::string& error) {
  const nlohmann::ordered_json answer{{"exit", static_cast<int>(exit)}, {"error", error}};
  return fmt::format("{}\n", answer.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
}

// "unknown option '--sed'; did you mean '--seed'?", for the first word that `app` does not know.
std::string unexpected(const CLI::App& app) {
  const auto words = app.remaining(true);
  if (words.empty()) return "";
  const bool option = words.front().starts_with("-");
  std::vector<std::string> known;
  for (const CLI::Option* each : app.get_options())
    for (const std::string& name : each->get_lnames()) known.push_back("--" + name);
  return fmt::format("unknown {} '{}'{}", option ? "option" : "argument", words.front(), option ? did_you_mean(words.front(), known) : "");
}

}  // namespace

void Verb::add_output_flags(const std::string& json, const std::string& quiet) {
  app_.add_flag("--json", json_, json);
  app_.add_flag("--quiet", quiet_, quiet);
}

void Verb::show(const std::string& text, const std::string& json) const {
  if (json_ || !quiet_) streams::put(json_ ? json : text);
}

Exit Verb::abandon(Exit exit, const std::string& error) {
  // The option's own count: what it was to set may not have been set when parsing ended.
  const CLI::Option* json = app_.get_option_no_throw("--json");
  if (json != nullptr && json->count() > 0) streams::put(refusal_json(exit, error));
  return exit;
}

CommandLine::CommandLine(int argc, const char* const* argv) : words_(argv, argv + argc), app_("", "consort") {
  app_.formatter(std::make_shared<ManualPage>());
  document(
      app_,
      "runs distributed consensus as real processes that talk over DDS\n"
      "One agent, one operating-system process. An experiment is one YAML file: agents, protocol, topology, links, faults, stop rule, "
      "metrics and acceptance criteria. `consort run` runs it and says with its exit code whether the criteria held; the same file gives "
      "the same numbers, bit for bit, with real processes and in a simulation.\n"
      "\n"
      "`consort VERB --help` describes each verb.",
      {{"consort run experiments/meet_for_dinner.yaml", "Ten agent processes agree on a time; results go to results/."},
       {"consort run experiments/meet_for_dinner.yaml --mode simulate --runs 100", "The same without processes, over a hundred seeds."},
       {"consort validate experiments/kalman_bias.yaml", "What theory says before anything starts."},
       {"consort doctor", "Can this host run a thousand agents?"}},
      {{"0", "all is well, all criteria are met"},
       {"1", "a criterion was not met"},
       {"2", "bad input: the command line or the experiment file"},
       {"3", "an agent or the run failed, the run is incomplete, or output cannot be written"},
       {"4", "timed out"},
       {"130, 143", "interrupted by SIGINT, SIGTERM"}});
  app_.set_help_flag("-h,--help", "Show this page.");
  app_.set_version_flag("--version", version_text("consort"), "Show the version, and of what it was built.");
  app_.require_subcommand(0, 1);
  verbs_.push_back(make_run_verb(app_, words_));
  verbs_.push_back(make_validate_verb(app_));
  verbs_.push_back(make_graph_verb(app_));
  verbs_.push_back(make_list_verb(app_));
  verbs_.push_back(make_doctor_verb(app_));
  verbs_.push_back(make_export_verb(app_));
  verbs_.push_back(make_report_verb(app_));
  verbs_.push_back(make_watch_verb(app_));
  verbs_.push_back(make_diff_verb(app_));
  verbs_.push_back(make_replay_verb(app_));
  verbs_.push_back(make_test_verb(app_));
  verbs_.push_back(make_collect_verb(app_));
  verbs_.push_back(make_results_verb(app_));
  verbs_.push_back(make_lend_verb(app_));
  verbs_.push_back(make_completion_verb(app_));
  for (CLI::App* verb : app_.get_subcommands({})) verb->set_help_flag("-h,--help", "Show this page.");
}

Exit CommandLine::execute() {
  if (words_.size() > 1 && !words_[1].starts_with("-")) {
    std::vector<std::string> names;
    for (const auto& verb : verbs_) names.push_back(verb->app().get_name());
    if (std::find(names.begin(), names.end(), words_[1]) == names.end())
      throw ConfigError(fmt::format("no verb '{}'{}; allowed: {}", words_[1], did_you_mean(words_[1], names), listed(names)));
  }
  std::vector<std::string> arguments(words_.rbegin(), words_.rend() - 1);  // CLI11 takes them last first
  app_.parse(arguments);
  for (const auto& verb : verbs_) {
    if (verb->app().parsed()) return verb->execute();
  }
  streams::tell(app_.help());
  return Exit::bad_input;
}

int CommandLine::answer(const CLI::ParseError& stop) {
  if (stop.get_exit_code() == 0) {  // a page that was asked for
    std::ostringstream out;
    app_.exit(stop, out, out);
    streams::put(out.str());
    return static_cast<int>(Exit::ok);
  }
  const auto chosen = std::find_if(verbs_.begin(), verbs_.end(), [](const auto& verb) { return verb->app().parsed(); });
  const CLI::App& app = chosen == verbs_.end() ? app_ : (*chosen)->app();
  const std::string unknown = unexpected(app);
  return fail(Exit::bad_input, fmt::format("{}; see `consort{} --help`", unknown.empty() ? stop.what() : unknown,
                                           &app == &app_ ? "" : " " + app.get_name()));
}

int CommandLine::fail(Exit exit, const std::string& error) {
  bool known = false;
  for (const auto& verb : verbs_) {
    if (!verb->app().parsed()) continue;
    exit = verb->abandon(exit, error);
    known = true;
  }
  if (!known && std::find(words_.begin(), words_.end(), "--json") != words_.end()) streams::put(refusal_json(exit, error));
  say(error);
  return static_cast<int>(exit);
}

}  // namespace consort
