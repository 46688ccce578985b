#pragma once
/// How a process of a run is started: the options that agents and plant share, and what every such process does.

#include "process/run_member.hpp"

#include <sys/types.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

namespace consort {

struct RunProcessOptions {
  std::string ids;  ///< of who hosts agents: 7, 1-25 or 1,4,9-12
  std::string run, interface = "lo", discovery = "multicast", data = "unicast", neighbour_ports;
  unsigned domain = 0, port = 0;
  std::uint32_t first_epoch = 0, first_round = 0;
  bool open_domain = false;  ///< no discovery tag
  bool tuned = false;
  double transmit_loss = 0.0;
  double wait = 60.0;
  bool key_on_stdin = false;
  std::string build;  ///< of the orchestrator that started it
  pid_t orchestrator = 0;

  [[nodiscard]] Arrival arrival() const;
  /// Packets may be lost on the way: not within a host, unless the experiment wants it.
  [[nodiscard]] bool lossy() const { return interface != "lo" || transmit_loss > 0.0; }
};

struct RunProgram {
  const char* name;
  const char* help;
  bool hosts_agents;  ///< takes `--ids`, and is woken by what agents tell each other with multicast
};

using MakeMember = std::function<std::unique_ptr<RunMember>(const wire::Participant&)>;

/// A program's main(): parses the command line, lets `prepare` read it, joins the run's domain, makes the member and runs it; SIGINT,
/// SIGTERM, SIGHUP and the death of the orchestrator that started it end it. The exit code; a failure is a line on standard error.
int run_process(const RunProgram& program, int argc, char** argv, const std::function<MakeMember(const RunProcessOptions&)>& prepare);

}  // namespace consort
