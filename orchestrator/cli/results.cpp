#include "core/counted.hpp"
#include "core/errors.hpp"
#include "core/option_text.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/kept_results.hpp"
#include "orchestrator/report/results_folders.hpp"
#include "orchestrator/report/terminal.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <optional>

namespace consort {
namespace {

using Folders = std::vector<ResultsFolder>;

nlohmann::ordered_json json_of(const ResultsFolder& folder) {
  return {{"folder", folder.path.string()},
          {"experiment", folder.experiment},
          {"began", folder.began},
          {"verdict", folder.verdict},
          {"mode", folder.mode},
          {"seed", folder.seed},
          {"runs", folder.runs},
          {"agents", folder.agents},
          {"bytes", folder.bytes}};
}

std::string as_text(const nlohmann::ordered_json& json) {
  return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string as_json(const Folders& folders) {
  auto all = nlohmann::ordered_json::array();
  for (const ResultsFolder& folder : folders) all.push_back(json_of(folder));
  return as_text(all);
}

// A line each, in columns.
std::string table_of(const Folders& folders) {
  std::size_t widest = 0;
  std::uintmax_t bytes = 0;
  for (const ResultsFolder& folder : folders) {
    widest = std::max(widest, shown_width(folder.path.string()));
    bytes += folder.bytes;
  }
  std::string out;
  for (const ResultsFolder& folder : folders)
    out += fmt::format("{}{}  {:<20}  {:<11}  {:>8}  {}{}seed {}\n", folder.path.string(),
                       std::string(widest - shown_width(folder.path.string()), ' '), folder.began, folder.verdict, bytes_text(folder.bytes),
                       folder.mode, folder.mode.empty() ? "" : ", ", folder.seed);
  return out + fmt::format("{}, {}\n", counted(folders.size(), "run"), bytes_text(bytes));
}

class ResultsVerb : public Verb {
 public:
  explicit ResultsVerb(CLI::App& parent) : Verb(*parent.add_subcommand("results", "")) {
    document(
        app_,
        "list, show or delete the results on this disk\n"
        "list: every run below the folders, oldest first: folder, when it began (UTC), verdict, size, mode, seed. show: one run with "
        "its criteria and metrics, and how to repeat it. prune: deletes runs that are old, or more than enough, after asking; a folder "
        "that holds anything but what a run leaves there, and a run that goes on, are never deleted.",
        {{"consort results", "What is in results/."},
         {"consort results show results/ring-20250131-194500", "One of them."},
         {"consort results prune --older-than 30d --keep 3", "Those older than 30 days, but of each experiment not the newest three."},
         {"consort results list studies --json | jq '.[] | select(.verdict == \"not met\") | .folder'", "For a script."}},
        {{"0", "done; prune: also if there was nothing to delete, or the answer was no"},
         {"2", "no such folder, or prune is not told what may go"},
         {"3", "something could not be deleted"}});
    app_.add_option("action", action_, "list, show or prune. Default: list.")
        ->type_name("ACTION")
        ->check(one_of({"list", "show", "prune"}));
    app_.add_option("folders", folders_, "Results folders, or folders that hold some. Default: results.")->type_name("DIR");
    app_.add_option("--older-than", age_, "prune: those that began longer ago, as 30d (min, h, d, w).")->type_name("AGE");
    app_.add_option("--keep", keep_, "prune: all but the newest N of each experiment.")->type_name("N");
    app_.add_flag("--yes", yes_, "prune: do not ask.");
    add_output_flags("Print it as JSON; prune: what was deleted.", "Print nothing but mistakes.");
  }

  Exit execute() override {
    if (action_ != "prune" && (!age_.empty() || !keep_.empty() || yes_))
      throw ConfigError("--older-than, --keep and --yes are of `consort results prune`; found " + action_);
    if (action_ == "show") return show_each();
    if (action_ == "prune") return prune();
    const Folders all = found();
    show(table_of(all), as_json(all));
    return Exit::ok;
  }

 private:
  [[nodiscard]] Folders found() const {
    Folders all;
    if (folders_.empty() && !std::filesystem::exists("results")) return all;  // nothing has run here
    for (const std::string& folder : folders_.empty() ? std::vector<std::string>{"results"} : folders_) {
      Folders some = results_below(folder);
      std::move(some.begin(), some.end(), std::back_inserter(all));
    }
    std::stable_sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.began < b.began; });
    return all;
  }

  Exit show_each() {
    if (folders_.empty()) throw ConfigError("show: found no folder; allowed: results folders, see `consort results`");
    std::string text;
    auto json = nlohmann::ordered_json::array();
    for (const std::string& path : folders_) {
      const ResultsFolder folder = describe(path);
      const KeptResults kept = kept_results(path);
      text += table_of({folder});
      json.push_back(json_of(folder));
      for (const KeptCriterion& criterion : kept.criteria) {
        const char* met = !criterion.met ? "open" : *criterion.met ? "met" : "not met";
        text += fmt::format("  {:<7}  {:<12.6g}  {}\n", met, criterion.value, criterion.text);
        json.back()["criteria"].push_back(
            {{"text", criterion.text}, {"met", criterion.met ? nlohmann::ordered_json(*criterion.met) : nullptr}});
      }
      for (const auto& [name, value] : kept.metrics) {
        text += fmt::format("  {} = {}\n", name, value);
        json.back()["metrics"][name] = value;
      }
      text += fmt::format("  consort replay {}\n", path);
    }
    show(text, as_text(json));
    return Exit::ok;
  }

  Exit prune() {
    std::optional<double> age;
    std::optional<std::size_t> keep;
    if (!age_.empty()) age = parse_age("--older-than", age_);
    if (!keep_.empty()) keep = whole_option<std::size_t>("--keep", keep_, 0, 1'000'000'000);
    if (!age && !keep) throw ConfigError("prune: found nothing that says what may go; allowed: --older-than AGE, --keep N, or both");
    Folders chosen = to_prune(found(), std::time(nullptr), age, keep);
    std::erase_if(chosen, [](const ResultsFolder& folder) {
      const auto strange = strange_entries(folder.path);
      if (!strange.empty()) say(fmt::format("{} stays: it holds {}, which no run leaves there", folder.path.string(), strange.front()));
      return !strange.empty();
    });
    if (chosen.empty() || !agreed(chosen)) {
      show(chosen.empty() ? "nothing to delete\n" : "nothing was deleted\n", "[]\n");
      return Exit::ok;
    }
    for (const ResultsFolder& folder : chosen) remove_results(folder.path);
    show(fmt::format("deleted {}\n", counted(chosen.size(), "run")), as_json(chosen));
    return Exit::ok;
  }

  // Asks on the terminal; where there is none, it has to be said beforehand.
  [[nodiscard]] bool agreed(const Folders& chosen) const {
    if (yes_) return true;
    if (::isatty(STDIN_FILENO) == 0) throw ConfigError("prune: found nobody to ask; allowed: --yes");
    streams::tell(table_of(chosen) + "Delete them? [y/N] ");
    std::string answer;
    std::getline(std::cin, answer);
    return answer == "y" || answer == "yes";
  }

  std::string action_ = "list", age_, keep_;
  std::vector<std::string> folders_;
  bool yes_ = false;
};

}  // namespace

std::unique_ptr<Verb> make_results_verb(CLI::App& parent) { return std::make_unique<ResultsVerb>(parent); }

}  // namespace consort
