#include "process/run_process.hpp"

#include "core/build.hpp"
#include "core/errors.hpp"
#include "core/id_list.hpp"
#include "core/nearest.hpp"
#include "core/option_text.hpp"
#include "idl/dds_failure.hpp"
#include "idl/dds_log.hpp"
#include "idl/trust.hpp"
#include "io/interfaces.hpp"
#include "io/standard_streams.hpp"

#include <dds/dds.hpp>

#include <pthread.h>
#include <sys/prctl.h>
#include <unistd.h>
#include <CLI/CLI.hpp>

#include <atomic>
#include <condition_variable>
#include <csignal>
#include <cstdlib>
#include <iostream>
#include <limits>
#include <mutex>
#include <new>
#include <optional>
#include <sstream>
#include <stop_token>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace consort {
namespace {

void add_options(CLI::App& app, RunProcessOptions& options, bool hosts_agents) {
  const auto whole = [&app](const std::string& name, auto& into, std::uint64_t low, std::uint64_t high, const std::string& meaning) {
    return app.add_option_function<std::string>(
        name,
        [&into, name, low, high](const std::string& text) {
          into = static_cast<std::remove_reference_t<decltype(into)>>(whole_option(name, text, low, high));
        },
        meaning);
  };
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  constexpr double kLongestWait = 1e9;  // s
  if (hosts_agents) app.add_option("--ids,--id", options.ids, "agents to host: 7, 1-25 or 1,4,9-12")->required();
  app.set_version_flag("--version", version_text(app.get_name()));
  app.add_option("--run", options.run, "name of the run, as `consort run` prints it")->required();
  whole("--domain", options.domain, 0, 230, "DDS domain of the run")->required();
  app.add_option("--interface", options.interface, "network interface (name or address)")->capture_default_str();
  app.add_option("--discovery", options.discovery, "how processes find each other")
      ->check(CLI::IsMember({"multicast", "neighbours"}))
      ->capture_default_str();
  app.add_option("--data", options.data, "how messages travel with multicast discovery")
      ->check(CLI::IsMember({"unicast", "multicast"}))
      ->capture_default_str();
  whole("--port", options.port, 1024, 65000,
        "neighbours discovery: own UDP port; multicast: first of those of the run (default: those of the domain)");
  app.add_option("--neighbour-ports", options.neighbour_ports,
                 "neighbours discovery: UDP ports to announce to, comma separated; ADDRESS:PORT on other hosts");
  app.add_flag("--open-domain", options.open_domain, "without the discovery tag that keeps other programs of the domain out");
  app.add_flag("--tuned", options.tuned, "slower acknowledgements, for the start of many processes that all find each other");
  whole("--first-epoch", options.first_epoch, 0, kMost, "of who comes back: the run of the session in which it does");
  whole("--first-round", options.first_round, 0, kMost, "and the round; what its earlier stay was told is left alone");
  app.add_option_function<std::string>(
      "--transport-loss",
      [&options](const std::string& text) { options.transmit_loss = number_option("--transport-loss", text, 0.0, 0.9); },
      "share of outgoing packets to throw away, for experiments");
  app.add_option_function<std::string>(
         "--wait", [&options](const std::string& text) { options.wait = number_option("--wait", text, 0.0, kLongestWait); },
         "how long to look for the run, in seconds; 0: for ever")
      ->default_str("60");
  app.add_option("--build", options.build, "of the orchestrator that starts this process; another one is refused");
  app.add_flag("--key-on-stdin", options.key_on_stdin, "the run's key is the first line of standard input, not in CONSORT_KEY");
  whole("--orchestrator-pid", options.orchestrator, 1, std::numeric_limits<pid_t>::max(), "leave when this parent process dies");
}

dds::configuration::Settings settings_of(const RunProcessOptions& options, bool hosts_agents) {
  dds::configuration::Settings settings;
  settings.interface = options.interface;
  if (!options.open_domain) settings.tag = options.run;
  settings.data = options.data == "multicast" ? dds::configuration::Data::multicast : dds::configuration::Data::unicast;
  settings.tuned = options.tuned;
  settings.transmit_loss = options.transmit_loss;
  settings.hears_multicast_data = hosts_agents;
  if (options.lossy()) settings.spdp_interval = dds::configuration::kAnnounceAgain;
  settings.writer_high_watermark = std::size_t{1} << 30;  // a step on the receive thread must never wait for an acknowledgement
  settings.writer_linger = std::chrono::milliseconds(0);  // whoever needs to know that something arrived waits for it
  // Whether this process is alive its Presence tells; a cut, or a stop, must not make others forget it.
  settings.lease_duration = dds::configuration::kLongestLease;
  if (options.port != 0 && !options.tuned) settings.spdp_interval = std::chrono::milliseconds(2000);
  if (options.port != 0) settings.port_base = static_cast<std::uint16_t>(options.port);
  if (options.discovery == "neighbours") {
    settings.discovery = dds::configuration::Discovery::neighbours;
    settings.port_base = static_cast<std::uint16_t>(options.port - dds::configuration::unicast_port(0));
    std::stringstream ports(options.neighbour_ports);
    for (std::string at; std::getline(ports, at, ',');)
      settings.neighbours.push_back(at.find(':') == std::string::npos ? "127.0.0.1:" + at : at);
  }
  return settings;
}

void expect_build(const std::string& word) {
  if (word.empty()) return;
  const wire::Build own = wire::Build::own(), orchestrators = wire::Build::from_word(word);
  if (!own.fits(orchestrators))
    throw RunError("this program is " + own.text() + ", the `consort` that started it " + orchestrators.text() +
                   ": build or install all three programs together");
}

// Is told when the orchestrator that started it dies; one that is gone already is noticed too. The signal is SIGCONT, which reaches a
// process that is stopped as well.
void die_with(pid_t orchestrator) {
  if (orchestrator == 0) return;
  prctl(PR_SET_PDEATHSIG, SIGCONT);
  if (getppid() != orchestrator) throw RunError("the orchestrator (pid " + std::to_string(orchestrator) + ") is gone");
}

// What the main thread and the one that waits for signals share; the second ends with the process only.
struct Ending {
  std::atomic<int> caught{0};
  std::mutex mutex;
  std::function<void(bool orphaned)> interrupt;  // empty when the member is gone
};

// While it exists, the member is interrupted when the process is to end.
class InterruptedAtEnd {
 public:
  InterruptedAtEnd(Ending& ending, std::function<void(bool orphaned)> interrupt) : ending_(ending) { set(std::move(interrupt)); }
  ~InterruptedAtEnd() { set(nullptr); }
  InterruptedAtEnd(const InterruptedAtEnd&) = delete;
  InterruptedAtEnd& operator=(const InterruptedAtEnd&) = delete;

 private:
  void set(std::function<void(bool orphaned)> interrupt) {
    const std::lock_guard lock(ending_.mutex);
    ending_.interrupt = std::move(interrupt);
  }
  Ending& ending_;
};

// Waits for what ends the process: SIGINT, SIGTERM, SIGHUP, or the death of the orchestrator. Then lets the member end by itself, but not
// for longer than a few seconds.
void wait_for_the_end(Ending& ending, const sigset_t& signals, pid_t orchestrator) {
  constexpr timespec kPatience{3, 0};
  // The word of a death that came before the signals were blocked is lost, so who asks for it looks first.
  const auto is_orphan = [orchestrator] { return orchestrator != 0 && getppid() != orchestrator; };
  int signal = SIGCONT;
  bool orphaned = is_orphan();
  while (signal == SIGCONT && !orphaned) {
    sigwait(&signals, &signal);
    orphaned = is_orphan();
  }
  ending.caught = orphaned ? SIGTERM : signal;
  {
    const std::lock_guard lock(ending.mutex);
    if (ending.interrupt) ending.interrupt(orphaned);
  }
  sigset_t none;
  sigemptyset(&none);
  sigtimedwait(&none, nullptr, &kPatience);
  std::_Exit(128 + ending.caught);
}

// Shows, while it exists, that this process is alive.
class SignsOfLife {
 public:
  explicit SignsOfLife(dds::domain::DomainParticipant& participant)
      : thread_([&participant](const std::stop_token& stop) {
          std::mutex mutex;
          std::condition_variable_any ending;
          std::unique_lock lock(mutex);
          do participant.assert_liveliness();
          while (!ending.wait_for(lock, stop, std::chrono::duration<double>(wire::kSignOfLifeEvery),
                                  [&stop] { return stop.stop_requested(); }));
        }) {}

 private:
  std::jthread thread_;
};

// Who started the process (nohup) wants it to outlive the terminal. (A signal that is blocked is kept, ignored or not, and sigwait would
// find it.)
bool ignores_hang_up() {
  struct sigaction inherited {};
  return sigaction(SIGHUP, nullptr, &inherited) == 0 && inherited.sa_handler == SIG_IGN;
}

// The domain of the run, and this process in it. Throws ConfigError or RunError, in words, where it cannot be opened.
struct Joined {
  dds::domain::Domain domain;
  wire::Participant participant;

  Joined(const RunProcessOptions& options, const RunProgram& program, const wire::RunKey& key) try
      : domain(options.domain, dds::domain::with_user_configuration(dds::configuration::xml(settings_of(options, program.hosts_agents)))),
        participant(domain, {program.name, wire::Build::own(), options.ids}, key) {
    const auto tell = [](const std::string& line) { streams::tell(line + "\n"); };
    for (const std::string& warning : wire::DdsLog::of_this_process().take_reasons()) tell("DDS: " + warning);
    wire::DdsLog::of_this_process().write_to(tell);  // only now: why there is no domain is told in other words
  } catch (const dds::core::Exception& failure) {
    wire::raise_no_domain(failure, "DDS domain " + std::to_string(options.domain),
                          options.port == 0 ? "allowed: another --domain" : "allowed: a --port that is free, and the one above it");
  }
};

wire::RunKey key_on_stdin() {
  std::string secret;
  if (!std::getline(std::cin, secret) || secret.empty())
    throw ConfigError("--key-on-stdin: found nothing; allowed: a line with the run's key");
  return wire::RunKey(secret);
}

// Joins the run's domain, makes the member and runs it. The exit code.
int serve(const RunProcessOptions& options, const RunProgram& program, const MakeMember& make) {
  const auto key = options.key_on_stdin ? key_on_stdin() : wire::RunKey::of_environment();
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  if (!ignores_hang_up()) sigaddset(&signals, SIGHUP);
  sigaddset(&signals, SIGCONT);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);  // before DDS starts its threads, so that they inherit it

  wire::DdsLog::of_this_process();  // listens to DDS from now on
  const Joined joined(options, program, key);
  const wire::Participant& participant = joined.participant;
  dds::domain::DomainParticipant entity = participant;
  const std::unique_ptr<RunMember> member = make(participant);
  std::optional<SignsOfLife> signs;
  if (options.orchestrator == 0) signs.emplace(entity);
  const auto ending = std::make_shared<Ending>();
  const InterruptedAtEnd interrupted(*ending, [&member](bool orphaned) { member->interrupt(orphaned); });
  std::thread([ending, signals, orchestrator = options.orchestrator] { wait_for_the_end(*ending, signals, orchestrator); }).detach();
  member->run();
  return ending->caught == 0 ? static_cast<int>(Exit::ok) : 128 + ending->caught;
}

}  // namespace

Arrival RunProcessOptions::arrival() const {
  const std::string ports =
      port == 0 && discovery == "multicast" ? ", UDP port " + std::to_string(7400 + 250 * domain) + " for discovery" : std::string();
  return {orchestrator != 0, wait,
          "run " + run + " (its DDS discovery tag) in DDS domain " + std::to_string(domain) + " on interface " + interface + ports};
}

int run_process(const RunProgram& program, int argc, char** argv, const std::function<MakeMember(const RunProcessOptions&)>& prepare) {
  streams::prepare();
  RunProcessOptions options;
  CLI::App app(program.help, program.name);
  add_options(app, options, program.hosts_agents);
  try {
    app.parse(argc, argv);
    expect_build(options.build);
    die_with(options.orchestrator);
    if (program.hosts_agents) options.ids = to_text(parse_ids("--ids", options.ids));
    if (const std::string refusal = interface_refusal(options.interface); !refusal.empty()) throw ConfigError("--interface: " + refusal);
    if (options.discovery == "neighbours" && options.port == 0)
      throw ConfigError("--port: found none with --discovery neighbours; allowed: this process's own UDP port, from 1024 to 65000");
    const MakeMember make = prepare(options);
    return serve(options, program, make);
  } catch (const CLI::ParseError& failure) {
    if (failure.get_exit_code() == 0) {
      std::ostringstream out, err;
      app.exit(failure, out, err);
      streams::put(out.str());
      return streams::concluded(program.name, static_cast<int>(Exit::ok));
    }
    std::vector<std::string> known;
    for (const CLI::Option* each : app.get_options())
      for (const std::string& name : each->get_lnames()) known.push_back("--" + name);
    // An unknown word is named before what is missing: it may stand for that.
    const std::string error = app.remaining().empty() ? failure.what() : unknown_word("option", app.remaining().front(), known);
    streams::tell(program.name + (": " + error + "; see `" + program.name + " --help`\n"));
    return static_cast<int>(Exit::bad_input);
  } catch (const ConfigError& failure) {
    streams::tell(program.name + (": " + std::string(failure.what())) + "\n");
    return static_cast<int>(Exit::bad_input);
  } catch (const TimeoutError& failure) {
    streams::tell(program.name + (": " + std::string(failure.what())) + "\n");
    return static_cast<int>(Exit::timed_out);
  } catch (const std::bad_alloc&) {
    streams::tell(std::string(program.name) + ": out of memory\n");
    return static_cast<int>(Exit::run_failed);
  } catch (const std::exception& failure) {
    streams::tell(program.name + (": " + std::string(failure.what())) + "\n");
    return static_cast<int>(Exit::run_failed);
  }
}

}  // namespace consort
