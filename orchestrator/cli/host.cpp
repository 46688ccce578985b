#include "core/counted.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "orchestrator/cli/doctor.hpp"
#include "orchestrator/report/export.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>

namespace consort {
namespace {

std::string dumped(const nlohmann::ordered_json& json) { return json.dump(2, ' ', false, nlohmann::json::error_handler_t::replace); }

class DoctorVerb : public Verb {
 public:
  explicit DoctorVerb(CLI::App& parent) : Verb(*parent.add_subcommand("doctor", "")) {
    document(
        app_,
        "check whether this host can run a thousand agents\n"
        "Looks whether the interface of a run and the DDS configuration in CYCLONEDDS_URI serve it, sends a multicast datagram over the "
        "loopback interface, asks the kernel for the receive buffer that discovery of many processes "
        "fills, "
        "compares the limits on threads, processes, open files and ports with what 1000 agent processes need, and looks for agents whose "
        "orchestrator is gone. Each check that fails is followed by the command that mends it.",
        {{"consort doctor", "All checks."},
         {"consort doctor --interface eth0 --json", "The same for runs with agents on other hosts, for a script."},
         {"consort doctor && consort run experiments/complete_100.yaml", "Run only on a host that is fit."}},
        {{"0", "all is well"}, {"3", "a check failed"}});
    app_.add_option("--interface", interface_, "The network interface (name or address) that a run is to use. Default: lo.")
        ->type_name("NAME");
    add_output_flags("Print the checks as JSON.", "Print nothing: the exit code says whether all is well.");
  }

  Exit execute() override {
    const auto checks = examine_host(interface_);
    const bool well = std::all_of(checks.begin(), checks.end(), [](const auto& check) { return check.well; });
    show(render(checks, style_of(STDOUT_FILENO)), as_json(checks, well));
    return well ? Exit::ok : Exit::run_failed;
  }

 private:
  static std::string as_json(const std::vector<DoctorCheck>& checks, bool well) {
    nlohmann::ordered_json json{{"well", well}, {"checks", nlohmann::ordered_json::array()}};
    for (const DoctorCheck& check : checks) {
      nlohmann::ordered_json one{{"name", check.name}, {"well", check.well}, {"found", check.found}};
      if (!check.well) one["remedy"] = check.remedy;
      json["checks"].push_back(one);
    }
    return dumped(json) + "\n";
  }

  std::string interface_ = "lo";
};

class ExportVerb : public Verb {
 public:
  explicit ExportVerb(CLI::App& parent) : Verb(*parent.add_subcommand("export", "")) {
    document(
        app_,
        "write a run's record as plain text\n"
        "Writes one file per table of DIR/record.sqlite to DIR/csv/: experiment, runs, agents, estimates, columns, metrics, results, "
        "criteria, segments, edges, links, network, processes, events. The first line names the columns, numbers read back exactly, an "
        "empty field is a value that is not there. The record of a run that crashed is exported up to its last commit; records of "
        "older versions are read as they are, and where their words meant something else is said on standard error. "
        "`sqlite3 DIR/record.sqlite .schema` explains every column.",
        {{"consort export results/meet_for_dinner-20250131-194500",
          "Writes results/meet_for_dinner-20250131-194500/csv/estimates.csv and its siblings."}},
        {{"0", "written"}, {"2", "the folder holds no record"}, {"3", "reading or writing failed"}});
    app_.add_option("folder", folder_, "The output folder of a run.")->required()->type_name("DIR");
    app_.add_flag("--csv", csv_, "Comma-separated values (RFC 4180): the only format there is, and the default.");
    add_output_flags("Print which files were written, and their rows, as JSON.",
                     "Print nothing: the exit code says whether all is written.");
  }

  Exit execute() override {
    const Exported exported = export_csv(folder_);
    nlohmann::ordered_json json{{"format", exported.format}, {"files", nlohmann::ordered_json::array()}};
    std::string text;
    for (const ExportedTable& table : exported.tables) {
      json["files"].push_back(nlohmann::ordered_json{{"file", table.file.string()}, {"rows", table.rows}});
      text += fmt::format("{}  {} {}\n", table.file.string(), grouped(table.rows), noun(table.rows, "row"));
    }
    json["remarks"] = exported.remarks;
    show(text, dumped(json) + "\n");
    if (!json_ && !quiet_)
      for (const std::string& remark : exported.remarks) streams::tell(fmt::format("{}\n", remark));
    return Exit::ok;
  }

 private:
  std::filesystem::path folder_;
  bool csv_ = true;
};

}  // namespace

std::unique_ptr<Verb> make_doctor_verb(CLI::App& parent) { return std::make_unique<DoctorVerb>(parent); }
std::unique_ptr<Verb> make_export_verb(CLI::App& parent) { return std::make_unique<ExportVerb>(parent); }

}  // namespace consort
