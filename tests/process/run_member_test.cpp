/// How a process comes into its run.

#include "process/run_member.hpp"

#include "tests/dds/ping.hpp"

#include <gtest/gtest.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <future>
#include <mutex>
#include <utility>

namespace consort {
namespace {

using ping::Side;

/// One that only looks for its run.
class Seeker : public RunMember {
 public:
  Seeker(const wire::Participant& participant, Arrival arrival) : RunMember(participant, std::move(arrival), 1, {AgentId{1}}) {}
  [[nodiscard]] bool began() const { return began_; }

 protected:
  void begin_run(Lock&) override { began_ = true; }
  void grant(const Grant&) override {}
  void beat(std::size_t, Round) override {}
  void depart(std::span<const AgentId>) override {}
  void come_back(std::span<const AgentId>, Round) override {}
  [[nodiscard]] bool report_due() const override { return false; }
  bool fill(wire::Telemetry&) override { return false; }
  std::vector<MemberReport> held_reports() override { return {}; }
  [[nodiscard]] Round met_until() const override { return 0; }
  [[nodiscard]] std::string unmet() const override { return "has no assignment yet"; }
  [[nodiscard]] bool may_greet() const override { return false; }
  [[nodiscard]] bool greeting_needed() const override { return false; }
  void greet() override {}
  void describe(wire::Presence&) const override {}
  bool ask() override { return false; }
  [[nodiscard]] std::uint64_t heard() const override { return 0; }
  [[nodiscard]] std::uint64_t came_twice() const override { return 0; }
  [[nodiscard]] wire::ReaderEvents reader_events() const override { return {}; }
  [[nodiscard]] std::uint64_t sent_again_bytes() const override { return 0; }
  [[nodiscard]] std::uint64_t missed_inputs() const override { return 0; }

 private:
  bool began_ = false;
};

/// While it exists, it hears what is logged, and keeps the first line that contains some words.
class Listener : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit Listener(std::string words) : words_(std::move(words)) {}
  std::future<std::string> line() { return line_.get_future(); }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string text(message.payload.data(), message.payload.size());
    if (text.find(words_) != std::string::npos && !std::exchange(heard_, true)) line_.set_value(text);
  }
  void flush_() override {}

 private:
  std::string words_;
  std::promise<std::string> line_;
  bool heard_ = false;
};

TEST(RunMember, WhoMeetsNobodySaysSoAndWhatItLooksForWhileItGoesOnLooking) {
  Side side(1);
  const auto listener = std::make_shared<Listener>("has met nobody");
  const auto logger = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("seeker", listener));
  Seeker seeker(side.participant, {.launched = false, .wait = 0.0, .sought = "run x in DDS domain 3", .log_every = 0.01});
  auto logged = listener->line();
  const auto running = std::async(std::launch::async, [&] { seeker.run(); });
  ASSERT_EQ(logged.wait_for(ping::kPatience), std::future_status::ready);
  const std::string line = logged.get();
  EXPECT_TRUE(line.starts_with("has met nobody for ")) << line;
  EXPECT_NE(line.find("looks for run x in DDS domain 3"), std::string::npos) << line;
  EXPECT_EQ(running.wait_for(std::chrono::seconds(0)), std::future_status::timeout) << "it goes on looking";
  seeker.interrupt(false);
  running.wait();
  EXPECT_FALSE(seeker.began());
  spdlog::set_default_logger(logger);
}

}  // namespace
}  // namespace consort
