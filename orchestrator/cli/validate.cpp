#include "core/counted.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/study.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/findings.hpp"
#include "orchestrator/report/portrait.hpp"
#include "orchestrator/script/script.hpp"
#include "rounds/simulate.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <filesystem>

namespace consort {
namespace {

nlohmann::ordered_json as_json(const Experiment& experiment, const std::vector<Finding>& findings) {
  nlohmann::ordered_json json;
  json["valid"] = true;
  json["experiment"] = experiment.name;
  json["mode"] = std::string(name_of(experiment.mode));
  json["seed"] = experiment.seed.value;
  json["runs"] = experiment.runs;
  json["rounds"] = experiment.rounds;
  json["agents"] = experiment.agents;
  json["agents_per_process"] = experiment.agents_per_process;
  json["protocols"] = nlohmann::ordered_json::array();
  for (const auto& protocol : experiment.protocols) json["protocols"].push_back(protocol.title());
  json["topology"] = experiment.topology_text;
  if (experiment.plant) json["plant"] = experiment.plant->model;
  json["metrics"] = experiment.metrics;
  json["criteria"] = experiment.criteria;
  json["findings"] = to_json(findings);
  return json;
}

// A file whose numbers a protocol refuses is invalid, although every key is in its place: builds each agent once.
void try_protocols(const Experiment& experiment) {
  for (const ProtocolChoice& choice : experiment.protocols) {
    const AgentMaker maker(experiment, choice, experiment.seed);
    for (std::size_t i = 0; i < experiment.agents; ++i) static_cast<void>(maker.make(agent_at(i)));
  }
}

class ValidateVerb : public Verb {
 public:
  explicit ValidateVerb(CLI::App& parent) : Verb(*parent.add_subcommand("validate", "")) {
    document(
        app_,
        "check an experiment and say what theory expects of it\n"
        "Reads FILE as `consort run` would, without running it. Prints what it says, a picture of who hears whom (up to 24 agents), and "
        "the "
        "conditions that theory asks of the topology schedule: connectivity in every round or over a window, balance, and what follows for "
        "each protocol. A condition that fails is a finding, not an error; one that is marked refused keeps `consort run` from starting, "
        "unless it is told to --force.",
        {{"consort validate experiments/meet_for_dinner.yaml", "The experiment in one page."},
         {"consort validate ring.yaml --json | jq '.findings[] | select(.verdict == \"fails\")'", "Only what theory warns of."}},
        {{"0", "the file is valid"}, {"2", "it is not; the text names file, line, column, what was found and what is allowed"}});
    app_.add_option("file", file_, "The experiment (YAML).")->required()->type_name("FILE");
    add_output_flags("Print the findings as JSON.",
                     "Print nothing but what is wrong with the file: the exit code says whether it is valid.");
  }

  Exit execute() override {
    const std::string text = experiment_text(file_);
    const Experiment experiment = parse_experiment(text, file_.string(), file_.parent_path());
    try_protocols(experiment);
    const std::vector<Finding> findings = examine(experiment);
    auto json = as_json(experiment, findings);
    std::string picture = portrait(experiment, findings, style_of(STDOUT_FILENO));
    if (!study_of(text, file_.string()).within_a_run) {
      const StudyPlan plan = make_plan(text, file_.string(), StudyAsked{.directory = file_.parent_path()});
      json["cells"] = plan.cells.size();
      picture +=
          fmt::format("  the first of {}, which are all valid; {}\n", counted(plan.cells.size(), "cell"), plan.cells.front().cell.shown());
    }
    show(picture, json.dump(2) + "\n");
    return Exit::ok;
  }

  Exit abandon(Exit exit, const std::string& error) override {
    const CLI::Option& json = *app_.get_option("--json");
    if (json.count() > 0)
      streams::put(fmt::format("{}\n", nlohmann::ordered_json{{"valid", false}, {"error", error}}.dump(
                                           2, ' ', false, nlohmann::json::error_handler_t::replace)));
    return exit;
  }

 private:
  std::filesystem::path file_;
};

}  // namespace

std::unique_ptr<Verb> make_validate_verb(CLI::App& parent) { return std::make_unique<ValidateVerb>(parent); }

}  // namespace consort
