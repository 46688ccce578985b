#include "agent/node.hpp"
#include "core/id_list.hpp"
#include "process/run_process.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <string>
#include <vector>

namespace {

using namespace consort;

constexpr const char* kHelp =
    R"(One process of a Consort run: hosts one agent or several, receives its assignment over DDS, exchanges messages with its neighbours.
`consort run` starts these processes; start one by hand to put an agent on another host or under a debugger:

  consort run experiment.yaml --name demo --domain 7 --external 3      # does not start agent 3, waits for it
  CONSORT_KEY=... consort-agent --id 3 --run demo --domain 7                           # the same host
  CONSORT_KEY=... consort-agent --id 3 --run demo --domain 7 --interface eth0          # another host on that network

The processes of a run know each other by its key, in the environment variable CONSORT_KEY: `consort run` prints it with the command to
enter, or takes it from the same variable. It reads no files; CYCLONEDDS_URI is merged into its DDS configuration and wins. It logs to
stderr and leaves when the run ends.
Exit codes: 0 the run ended; 2 bad options; 3 the run failed, refused this process, or its orchestrator disappeared; 4 no run was met
(--wait), or with --wait 0 its orchestrator disappeared; 130, 143 interrupted.)";

}  // namespace

int main(int argc, char** argv) {
  return run_process({"consort-agent", kHelp, true}, argc, argv, [](const RunProcessOptions& options) -> MakeMember {
    const auto log = std::make_shared<spdlog::logger>("agent " + options.ids, std::make_shared<spdlog::sinks::stderr_sink_mt>());
    log->set_pattern("%H:%M:%S.%e [%n] %^%l%$: %v");
    spdlog::set_default_logger(log);
    std::vector<AgentId> agents;
    for (const std::uint32_t id : parse_ids("--ids", options.ids)) agents.push_back(AgentId{id});
    return [options, agents](const wire::Participant& participant) {
      return std::make_unique<Node>(participant, NodeOptions{.agents = agents,
                                                             .first_epoch = options.first_epoch,
                                                             .first_round = options.first_round,
                                                             .arrival = options.arrival(),
                                                             .lossy = options.lossy()});
    };
  });
}
