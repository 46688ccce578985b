#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/study_command.hpp"
#include "orchestrator/cli/verbs.hpp"

#include <filesystem>

namespace consort {
namespace {

class CollectVerb : public Verb {
 public:
  explicit CollectVerb(CLI::App& parent) : Verb(*parent.add_subcommand("collect", "")) {
    document(app_,
             "make the table of a study from its cells\n"
             "Reads what the cells of the study in DIR have left, wherever they were run, and makes of it what `consort run` ends with: "
             "table.csv, table.tex, table.md, summary.json, record.sqlite and report.html. Criteria are judged over the whole table.",
             {{"consort run study.yaml --output study --plan", "Which cells there are."},
              {"consort run --resume study --cell 3", "One of them, on any machine that has the folder."},
              {"consort collect study", "The table."}},
             {{"0", "all criteria are met"},
              {"1", "a criterion was not met"},
              {"2", "DIR holds no plan of a study"},
              {"3, 4", "cells are missing, failed or timed out; the table has the others"}});
    app_.add_option("folder", folder_, "The folder of a study.")->required()->type_name("DIR");
    app_.add_flag("--no-report", no_report_, "Draw no page (report.html).");
    add_output_flags("Print summary.json instead of the table.", "Print nothing: the exit code says whether the criteria are met.");
  }

  Exit execute() override {
    return show_study(collect_study(folder_, no_report_), [this](const auto& text, const auto& json) { show(text, json); });
  }

 private:
  std::filesystem::path folder_;
  bool no_report_ = false;
};

}  // namespace

std::unique_ptr<Verb> make_collect_verb(CLI::App& parent) { return std::make_unique<CollectVerb>(parent); }

}  // namespace consort
