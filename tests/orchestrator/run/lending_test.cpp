/// The far end of a connection to another host: what it does as it is told, and what is left of it.

#include "orchestrator/run/lending.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/line_channel.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <nlohmann/json.hpp>

#include <array>
#include <csignal>
#include <optional>
#include <thread>

namespace consort {
namespace {

using nlohmann::json;

struct Pipe {
  std::array<int, 2> ends{};
  Pipe() { EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC), 0); }
};

/// A host that lends itself, with a program of the test's for consort-agent.
class Lent {
 public:
  explicit Lent(const std::string& agent) {
    signal(SIGPIPE, SIG_IGN);
    chmod(folder_.write("consort-agent", "#!/bin/sh\n" + agent).c_str(), 0755);
    Pipe orders, words;
    near_.emplace(words.ends[0], orders.ends[1]);
    serving_ = std::thread([this, in = orders.ends[0], out = words.ends[1]] {
      Lending lending(folder_.path(), in, out, [](const std::string& interface) { return nlohmann::ordered_json{interface}; });
      why_ = lending.serve();
    });
  }
  ~Lent() { why(); }

  void tell(const std::string& line) { near_->send(line); }
  void start(const std::string& name) {
    tell(R"({"start": ")" + name + R"(", "program": "consort-agent", "arguments": ["--ids", "1"], "key": "the secret"})");
  }
  /// The next line that has this word.
  json awaited(const std::string& word) {
    json found;
    EXPECT_TRUE(eventually([&] {
      near_->flush();
      for (const std::string& line : near_->take()) lines_.push_back(json::parse(line));
      for (auto line = lines_.begin(); line != lines_.end(); ++line)
        if (line->contains(word)) {
          found = *line;
          lines_.erase(line);
          return true;
        }
      return false;
    })) << word;
    return found;
  }
  /// Closes the connection; why the other end ended, if not by that.
  std::string why() {
    if (near_) near_->close_out();
    if (serving_.joinable()) serving_.join();
    return why_;
  }

 private:
  Folder folder_;
  std::optional<LineChannel> near_;
  std::vector<json> lines_;
  std::string why_;
  std::thread serving_;
};

TEST(Lending, StartsSignalsAndTellsLikeAParent) {
  Lent host("read key\necho \"said $* key $key env $CONSORT_KEY\"\nexec sleep 1000\n");
  EXPECT_NE(host.awaited("lends").at("arithmetic").get<std::string>().find("glibc"), std::string::npos);
  host.start("agent-1");
  const pid_t pid = host.awaited("started").at("pid").get<pid_t>();
  const auto said = host.awaited("log").at("text").get<std::string>();
  EXPECT_NE(said.find("said --ids 1 --orchestrator-pid " + std::to_string(getpid()) + " --key-on-stdin key the secret env \n"),
            std::string::npos)
      << said;
  host.tell(R"({"ping": 0})");
  host.awaited("pong");
  host.tell(R"({"examine": "eth0"})");
  EXPECT_EQ(host.awaited("examined").at("examined").at(0), "eth0");
  host.tell(R"({"signal": "agent-1", "number": 9})");
  const json died = host.awaited("died");
  EXPECT_EQ(died.at("pid"), pid);
  EXPECT_EQ(died.at("signal"), 9);
  EXPECT_EQ(host.why(), "");
}

TEST(Lending, NothingIsLeftWhenTheConnectionCloses) {
  Lent host("trap '' TERM\necho up\nwhile :; do sleep 1000; done\n");
  host.start("agent-1");
  const pid_t pid = host.awaited("started").at("pid").get<pid_t>();
  host.awaited("log");
  EXPECT_TRUE(runs(pid));
  EXPECT_EQ(host.why(), "");
  EXPECT_FALSE(runs(pid)) << "although it does not want to end";
}

TEST(Lending, WhatMakesNoSenseIsRefused) {
  {
    Lent host("true\n");
    host.tell(R"({"start": "x", "program": "/bin/sh", "arguments": [], "key": ""})");
    EXPECT_EQ(host.awaited("failed").at("why"), "/bin/sh is no program of a run");
    host.tell(R"({"use": "10.254.254.254", "ports": []})");
    EXPECT_NE(host.awaited("used").at("why").get<std::string>().find("which this host does not have"), std::string::npos);
    host.tell(R"({"use": "lo", "ports": [9]})");
    EXPECT_EQ(host.awaited("used").at("used"), "127.0.0.1");
  }
  for (const char* wrong : {"{", "7", R"({"signal": 3})", R"({"start": "x"})", R"({"use": "lo", "ports": ["a"]})"}) {
    Lent host("true\n");
    host.tell(wrong);
    host.awaited("lends");
    EXPECT_NE(host.why().find("found an order that makes no sense"), std::string::npos) << wrong;
  }
}

TEST(LineChannel, HandsOverWholeLinesAndClosesOnEndlessOnes) {
  Pipe there, back;
  LineChannel near(back.ends[0], there.ends[1]), far(there.ends[0], back.ends[1]);
  near.send("one\ntwo");
  EXPECT_EQ(far.take(), (std::vector<std::string>{"one", "two"}));
  const std::string block(std::size_t{1} << 20, 'x');
  std::size_t lines = 0;
  near.send(block + "\n" + block);
  ASSERT_TRUE(eventually([&] {
    near.flush();
    lines += far.take().size();
    return lines == 2;
  })) << "more than a pipe holds";
  near.close_out();
  EXPECT_TRUE(eventually([&] { return far.take(), !far.open(); }));
  Pipe endless, nowhere;
  LineChannel victim(endless.ends[0], nowhere.ends[1]);
  const std::string piece(50'000, 'x');
  int pieces = 0;
  for (; victim.open() && pieces < 1000; ++pieces) {
    EXPECT_EQ(write(endless.ends[1], piece.data(), piece.size()), static_cast<ssize_t>(piece.size()));
    EXPECT_TRUE(victim.take().empty());
  }
  EXPECT_LT(pieces, 1000) << "nobody means a line of 50 MB";
  close(endless.ends[1]);
  close(nowhere.ends[0]);
}

}  // namespace
}  // namespace consort
