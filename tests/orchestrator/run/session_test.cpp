/// What a run says while it waits for processes that others start.

#include "idl/wire.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/process_run.hpp"

#include <gtest/gtest.h>

#include <atomic>

namespace consort {
namespace {

/// Two agents that somebody else is to start.
Experiment pair() {
  return parse_experiment(
      "experiment: pair\nrounds: 5\nagents: {count: 2, protocol: local_voting, initial: {x: [0, 1]}}\ntopology: complete\n", "pair.yaml",
      ".");
}

/// Ends the run, as a signal would, once it has said something.
struct Listener : Keeper {
  void remark(const std::string& text) override {
    Keeper::remark(text);
    if (text.find(awaited) != std::string::npos) signal = 15;
  }
  std::string awaited;
  std::atomic<int> signal{0};
};

RunOptions options_of(const Listener& listener, const Folder& logs, int domain) {
  RunOptions options;
  options.run_name = unique_run_name("session");
  options.domain = domain;
  options.key = "a key for this test";
  options.log_directory = logs.path();
  options.external = {AgentId{1}, AgentId{2}};
  options.interrupt = &listener.signal;
  return options;
}

TEST(Session, WhoIsAwaitedForLongIsNamedWithWhatToDo) {
  const Folder logs;
  Listener listener;
  listener.awaited = "still waiting for agent-1, agent-2, to be started by hand, by the lines that this run has printed";
  RunOptions options = options_of(listener, logs, 72);
  options.tell_awaited_seconds = 0.01;
  run_processes(pair(), options, listener);
  EXPECT_EQ(listener.signal, 15) << "it was said, and not the deadline that ended it";
}

TEST(Session, AProcessOfTheSameWireFromOtherSourcesIsLetInAndNamed) {
  const Folder logs;
  Listener listener;
  listener.awaited = "built of commit f00df00df00d";
  const RunOptions options = options_of(listener, logs, 73);
  wire::Build build = wire::Build::own();
  build.commit = "f00df00df00d";
  const dds::domain::Domain domain(173, dds::configuration::xml({.tag = options.run_name, .external_domain = 73}));
  const wire::Participant agent(domain, {"consort-agent", build, "1"}, wire::RunKey(options.key));
  wire::Writer<wire::Presence> presence(agent);
  wire::Presence hello;
  hello.process = 1;
  hello.pid = 17;
  hello.host = "elsewhere";
  hello.agents = {AgentId{1}};
  presence.write(hello);
  run_processes(pair(), options, listener);
  ASSERT_EQ(listener.events.size(), 1u);
  EXPECT_NE(listener.events[0].find(" of agent 1 (pid " + std::to_string(getpid())), std::string::npos) << listener.events[0];
}

}  // namespace
}  // namespace consort
