#include "agent/node.hpp"
#include "idl/run_process.hpp"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <cctype>
#include <set>
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
Exit codes: 0 the run ended; 2 bad options; 3 the run failed or the orchestrator disappeared; 130, 143 interrupted.)";

/// "7", "1-25" or "1,4,9-12" -> ids, ascending.
std::vector<AgentId> parse_ids(const std::string& text) {
  std::set<std::uint32_t> ids;
  std::size_t at = 0;
  const auto number = [&] {
    std::size_t used = 0;
    unsigned long value = 0;
    if (at < text.size() && std::isdigit(static_cast<unsigned char>(text[at]))) value = std::stoul(text.substr(at, 9), &used);
    if (used == 0 || value == 0) throw ConfigError("--ids " + text + ": expected ids from 1 on such as 7, 1-25 or 1,4,9-12");
    at += used;
    return static_cast<std::uint32_t>(value);
  };
  while (true) {
    const std::uint32_t first = number();
    std::uint32_t last = first;
    if (at < text.size() && text[at] == '-') ++at, last = number();
    if (last < first || last - first >= 100'000)
      throw ConfigError("--ids " + text + ": " + std::to_string(first) + "-" + std::to_string(last) + " is not a range");
    for (std::uint32_t id = first; id <= last; ++id) ids.insert(id);
    if (at == text.size()) break;
    if (text[at++] != ',') throw ConfigError("--ids " + text + ": expected ids such as 7, 1-25 or 1,4,9-12");
  }
  std::vector<AgentId> agents;
  for (const std::uint32_t id : ids) agents.push_back(AgentId{id});
  return agents;
}

}  // namespace

int main(int argc, char** argv) {
  return run_process({"consort-agent", kHelp, true}, argc, argv, [](const RunProcessOptions& options) -> MakeMember {
    const auto log = std::make_shared<spdlog::logger>("agent " + options.ids, std::make_shared<spdlog::sinks::stderr_sink_mt>());
    log->set_pattern("%H:%M:%S.%e [%n] %^%l%$: %v");
    spdlog::set_default_logger(log);
    return [options, agents = parse_ids(options.ids)](const wire::Participant& participant) {
      return std::make_unique<Node>(participant, NodeOptions{.agents = agents,
                                                             .first_epoch = options.first_epoch,
                                                             .first_round = options.first_round,
                                                             .launched = options.orchestrator != 0,
                                                             .lossy = options.lossy()});
    };
  });
}
