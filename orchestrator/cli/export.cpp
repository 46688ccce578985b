#include "orchestrator/report/export.hpp"
#include "core/counted.hpp"
#include "core/errors.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/terminal.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <filesystem>

namespace consort {
namespace {

constexpr std::array<std::string_view, 4> kFormats{"csv", "json", "mat", "graphml"};  // in the order of ExportFormat
constexpr std::array<std::string_view, 3> kShapes{"tables", "long", "wide"};          // of ExportShape

std::vector<std::string> words(std::span<const std::string_view> of) { return {of.begin(), of.end()}; }

class ExportVerb : public Verb {
 public:
  explicit ExportVerb(CLI::App& parent) : Verb(*parent.add_subcommand("export", "")) {
    document(
        app_,
        "write a run's record for other programs\n"
        "Writes one file per table of DIR/record.sqlite to DIR/csv/ (or json/, mat/): experiment, runs, agents, estimates, columns, "
        "metrics, results, criteria, segments, edges, links, network, processes, events; or, with --shape, the estimates alone, long or "
        "wide. In CSV the first line names the columns, numbers read back exactly, an empty field is a value that is not there; MATLAB "
        "finds a struct per table; `--format graphml` writes each graph of the network to DIR/graphml/. The record of a run that crashed "
        "is exported up to its last commit; records of older versions are read as they are, and where their words meant something else "
        "is said on standard error. `sqlite3 DIR/record.sqlite .schema` explains every column.",
        {{"consort export results/meet_for_dinner-20250131-194500",
          "Writes results/meet_for_dinner-20250131-194500/csv/estimates.csv and its siblings."},
         {"consort export results/meet_for_dinner-20250131-194500 --format mat --shape wide",
          "Writes mat/wide_0.mat: a column per agent and component."}},
        {{"0", "written"}, {"2", "the folder holds no record"}, {"3", "reading or writing failed"}});
    app_.add_option("folder", folder_, "The output folder of a run.")->required()->type_name("DIR");
    app_.add_option("--format", format_,
                    "csv: comma-separated values (RFC 4180); json; mat: MATLAB, level 5; graphml: the graphs of the network. Default: csv.")
        ->type_name("FORMAT")
        ->check(one_of(words(kFormats)));
    app_.add_option("--shape", shape_,
                    "tables: as the record has them; long: a row per number (run, round, time, agent, component, value); wide: a table per "
                    "run, a row per reported round, a column per agent and component. Default: tables.")
        ->type_name("SHAPE")
        ->check(one_of(words(kShapes)));
    app_.add_flag("--csv", csv_, "The same as --format csv.");
    add_output_flags("Print which files were written, and their rows, as JSON.",
                     "Print nothing: the exit code says whether all is written.");
  }

  Exit execute() override {
    const auto format = static_cast<ExportFormat>(std::find(kFormats.begin(), kFormats.end(), format_) - kFormats.begin());
    const auto shape = static_cast<ExportShape>(std::find(kShapes.begin(), kShapes.end(), shape_) - kShapes.begin());
    if (format == ExportFormat::graphml && shape != ExportShape::tables)
      throw ConfigError("--shape: found --format graphml, which is of graphs; allowed: csv, json, mat");
    const Exported exported = export_record(folder_, format, shape);
    nlohmann::ordered_json json{{"format", exported.format}, {"files", nlohmann::ordered_json::array()}};
    std::string text;
    for (const WrittenTable& table : exported.tables) {
      json["files"].push_back(nlohmann::ordered_json{{"file", table.file.string()}, {"rows", table.rows}});
      text += fmt::format("{}  {} {}\n", table.file.string(), grouped(table.rows), noun(table.rows, "row"));
    }
    json["remarks"] = exported.remarks;
    show(text, json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
    if (!json_ && !quiet_)
      for (const std::string& remark : exported.remarks) streams::tell(fmt::format("{}\n", remark));
    return Exit::ok;
  }

 private:
  std::filesystem::path folder_;
  std::string format_ = "csv", shape_ = "tables";
  bool csv_ = true;
};

}  // namespace

std::unique_ptr<Verb> make_export_verb(CLI::App& parent) { return std::make_unique<ExportVerb>(parent); }

}  // namespace consort
