#include "plant/node.hpp"
#include "process/run_process.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

namespace {

constexpr const char* kHelp =
    R"(The plant process of a Consort run: the physics between actuation and measurement. It receives its assignment over DDS, sends each
agent's process what that agent measures, waits for everybody's control, and moves on by a round. `consort run` starts it where an
experiment has a plant; start it by hand to put it on another host or under a debugger:

  consort run experiment.yaml --name demo --domain 7 --external 0      # does not start the plant, waits for it
  CONSORT_KEY=... consort-plant --run demo --domain 7

The processes of a run know each other by its key, in the environment variable CONSORT_KEY: `consort run` prints it with the command to
enter, or takes it from the same variable. It reads no files; CYCLONEDDS_URI is merged into its DDS configuration and wins. It logs to
stderr and leaves when the run ends.
Exit codes: 0 the run ended; 2 bad options; 3 the run failed, refused this process, or its orchestrator disappeared; 4 no run was met
(--wait), or with --wait 0 its orchestrator disappeared; 130, 143 interrupted.)";

}  // namespace

int main(int argc, char** argv) {
  using namespace consort;
  return run_process({"consort-plant", kHelp, false}, argc, argv, [](const RunProcessOptions& options) -> MakeMember {
    const auto log = std::make_shared<spdlog::logger>("plant", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    log->set_pattern("%H:%M:%S.%e [%n] %^%l%$: %v");
    spdlog::set_default_logger(log);
    return
        [arrival = options.arrival()](const wire::Participant& participant) { return std::make_unique<PlantNode>(participant, arrival); };
  });
}
