#include "agent/node.hpp"

#include <pthread.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <sys/prctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <csignal>
#include <thread>

namespace {

using namespace consort;

struct Options {
  std::string ids, run, interface = "lo", discovery = "multicast", data = "unicast", neighbour_ports;
  unsigned domain = 0, port = 0;
  bool tuned = false;
  pid_t orchestrator = 0;
};

constexpr const char* kHelp =
    R"(One process of a Consort run: hosts one agent or several, receives its assignment over DDS, exchanges messages with its neighbours.
`consort run` starts these processes; start one by hand to put an agent on another host or under a debugger:

  consort run experiment.yaml --name demo --domain 7 --external 3      # does not start agent 3, waits for it
  consort-agent --id 3 --run demo --domain 7                           # the same host
  consort-agent --id 3 --run demo --domain 7 --interface eth0          # another host on that network

It reads no files; CYCLONEDDS_URI is merged into its DDS configuration and wins. It logs to stderr and leaves when the run ends.
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

dds::configuration::Settings settings_of(const Options& options) {
  dds::configuration::Settings settings;
  settings.interface = options.interface;
  settings.tag = options.run;
  settings.data = options.data == "multicast" ? dds::configuration::Data::multicast : dds::configuration::Data::unicast;
  settings.tuned = options.tuned;
  settings.writer_high_watermark = std::size_t{1} << 30;  // a step on the receive thread must never wait for an acknowledgement
  if (options.orchestrator == 0) settings.lease_duration = std::chrono::milliseconds(2000);
  if (options.discovery == "neighbours") {
    settings.discovery = dds::configuration::Discovery::neighbours;
    settings.port_base = static_cast<std::uint16_t>(options.port - dds::configuration::unicast_port(0, options.domain));
    settings.spdp_interval = std::chrono::milliseconds(2000);
    std::stringstream ports(options.neighbour_ports);
    for (std::string port; std::getline(ports, port, ',');) settings.neighbours.push_back("127.0.0.1:" + port);
  }
  return settings;
}

/// Dies with the orchestrator that started it; one that is gone already is noticed too.
void die_with(pid_t orchestrator) {
  if (orchestrator == 0) return;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != orchestrator) throw RunError("the orchestrator (pid " + std::to_string(orchestrator) + ") is gone");
}

int serve(const Options& options) {
  die_with(options.orchestrator);
  auto agents = parse_ids(options.ids);
  const auto log = std::make_shared<spdlog::logger>("agent " + options.ids, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  log->set_pattern("%H:%M:%S.%e [%n] %^%l%$: %v");
  spdlog::set_default_logger(log);

  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before DDS starts its threads, so that they inherit it

  const dds::domain::Domain domain(options.domain, dds::domain::with_user_configuration(dds::configuration::xml(settings_of(options))));
  const dds::domain::DomainParticipant participant(domain);
  Node node(participant, {.agents = std::move(agents), .launched = options.orchestrator != 0});
  int caught = 0;
  std::thread([&node, &caught, signals] {  // detached: it ends with the process
    sigwait(&signals, &caught);
    node.interrupt();
  })
      .detach();
  node.run();
  return caught == 0 ? static_cast<int>(Exit::ok) : 128 + caught;
}

}  // namespace

int main(int argc, char** argv) {
  Options options;
  CLI::App app(kHelp, "consort-agent");
  app.set_version_flag("--version", CONSORT_VERSION);
  app.add_option("--ids,--id", options.ids, "agents to host: 7, 1-25 or 1,4,9-12")->required();
  app.add_option("--run", options.run, "name of the run, as `consort run` prints it")->required();
  app.add_option("--domain", options.domain, "DDS domain of the run")->required()->check(CLI::Range(0, 230));
  app.add_option("--interface", options.interface, "network interface (name or address)")->capture_default_str();
  app.add_option("--discovery", options.discovery, "how processes find each other")
      ->check(CLI::IsMember({"multicast", "neighbours"}))
      ->capture_default_str();
  app.add_option("--data", options.data, "how messages travel with multicast discovery")
      ->check(CLI::IsMember({"unicast", "multicast"}))
      ->capture_default_str();
  app.add_option("--port", options.port, "neighbours discovery: own UDP port")->check(CLI::Range(1024, 65000));
  app.add_option("--neighbour-ports", options.neighbour_ports,
                 "neighbours discovery: UDP ports on this host to announce to, comma separated");
  app.add_flag("--tuned", options.tuned, "slower acknowledgements, for the start of many processes that all find each other");
  app.add_option("--orchestrator-pid", options.orchestrator, "leave when this parent process dies");
  try {
    app.parse(argc, argv);
    return serve(options);
  } catch (const CLI::ParseError& failure) {
    return app.exit(failure) == 0 ? 0 : static_cast<int>(Exit::bad_input);
  } catch (const ConfigError& failure) {
    std::fprintf(stderr, "consort-agent: %s\n", failure.what());
    return static_cast<int>(Exit::bad_input);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "consort-agent: %s\n", failure.what());
    return static_cast<int>(Exit::run_failed);
  }
}
