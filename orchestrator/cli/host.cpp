#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "orchestrator/cli/doctor.hpp"
#include "orchestrator/script/hosts.hpp"

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
         {"consort doctor --hosts hosts.yaml", "The same on every host of a list."},
         {"consort doctor && consort run experiments/complete_100.yaml", "Run only on a host that is fit."}},
        {{"0", "all is well"}, {"3", "a check failed"}});
    app_.add_option("--interface", interface_, "The network interface (name or address) that a run is to use. Default: lo.")
        ->type_name("NAME");
    app_.add_option(
            "--hosts", hosts_,
            "A list of hosts, as `consort run --hosts` takes it: each is examined over a connection, with its build, its clock and the "
            "way to it.")
        ->type_name("FILE");
    add_output_flags("Print the checks as JSON.", "Print nothing: the exit code says whether all is well.");
  }

  Exit execute() override {
    if (!hosts_.empty()) return examine_hosts();
    const auto checks = examine_host(interface_);
    const bool well = all_well(checks);
    show(render(checks, style_of(STDOUT_FILENO)), as_json(checks, well));
    return well ? Exit::ok : Exit::run_failed;
  }

 private:
  static bool all_well(const std::vector<DoctorCheck>& checks) {
    return std::all_of(checks.begin(), checks.end(), [](const auto& check) { return check.well; });
  }

  // Every host of a list, as its own doctor finds it, and how it is reached.
  Exit examine_hosts() {
    const auto hosts = load_hosts(hosts_);
    std::string text;
    nlohmann::ordered_json json{{"well", true}, {"hosts", nlohmann::ordered_json::object()}};
    for (const auto& [name, checks] : examine_over_connections(hosts)) {
      const bool well = all_well(checks);
      text += fmt::format("{}{}\n{}", text.empty() ? "" : "\n", name, render(checks, style_of(STDOUT_FILENO)));
      json["hosts"][name] = to_json(checks);
      if (!well) json["well"] = false;
    }
    show(text, dumped(json) + "\n");
    return json["well"].get<bool>() ? Exit::ok : Exit::run_failed;
  }

  static std::string as_json(const std::vector<DoctorCheck>& checks, bool well) {
    return dumped({{"well", well}, {"checks", to_json(checks)}}) + "\n";
  }

  std::string interface_ = "lo";
  std::filesystem::path hosts_;
};

}  // namespace

std::unique_ptr<Verb> make_doctor_verb(CLI::App& parent) { return std::make_unique<DoctorVerb>(parent); }

}  // namespace consort
