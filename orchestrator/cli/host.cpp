#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "orchestrator/cli/doctor.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>

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

}  // namespace

std::unique_ptr<Verb> make_doctor_verb(CLI::App& parent) { return std::make_unique<DoctorVerb>(parent); }

}  // namespace consort
