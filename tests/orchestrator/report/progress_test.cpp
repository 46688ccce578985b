#include "orchestrator/report/progress.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using namespace std::chrono_literals;

/// A Progress with a clock that moves only when told, and what it has written.
struct Watched {
  Experiment experiment;
  Progress::Time now{};
  std::vector<std::string> written;
  Progress progress;

  explicit Watched(TextStyle style, std::size_t runs = 1)
      : experiment(make(runs)),
        progress(
            experiment, style, [this](std::string_view text) { written.emplace_back(text); }, [this] { return now; }) {}

  static Experiment make(std::size_t runs) {
    Experiment experiment;
    experiment.name = "small";
    experiment.agents = 2;
    experiment.rounds = 1000;
    experiment.runs = runs;
    experiment.protocols = {{"local_voting", {}}};
    return experiment;
  }

  void report(Round k, std::size_t number = 0) {
    const std::vector<double> estimates{1.0, 1.25};
    progress.report({number, 0, Seed{1}}, {k, estimates, {}, {}});
  }
};

const Trace kScalar = [] {
  Trace outline;
  outline.agents = 2;
  outline.dimension = 1;
  outline.estimate_layout = {{{"x", 1, 1}}};
  return outline;
}();
const TextStyle kPlain{true, false, false, 80};
const TextStyle kTerminal{true, false, true, 80};

TEST(Progress, PlainLinesComeAtMostOncePerSecond) {
  Watched watched(kPlain);
  for (std::size_t found = 0; found < 10; ++found) {
    watched.progress.launching(found, found / 2, 10);
    watched.now += 150ms;
  }
  ASSERT_EQ(watched.written.size(), 1u);
  EXPECT_EQ(watched.written[0], "found 7 of 10, ready 3 of 10\n");
  watched.progress.launching(10, 10, 10);
  ASSERT_EQ(watched.written.size(), 2u) << "that all are there is always told";
  EXPECT_EQ(watched.written[1], "found 10 of 10, ready 10 of 10\n");
  watched.progress.run_begins({0, 0, Seed{1}}, kScalar);
  for (Round k = 0; k < 100; ++k) {
    watched.now += 25ms;
    watched.report(k);
  }
  EXPECT_EQ(watched.written.size(), 4u) << "2.5 s have passed";
}

TEST(Progress, LinesTellRoundsSpeedAndDisagreement) {
  Watched watched(kPlain, 5);
  watched.progress.run_begins({0, 0, Seed{1}}, kScalar);
  watched.now += 2s;
  watched.report(500);
  ASSERT_EQ(watched.written.size(), 1u);
  EXPECT_EQ(watched.written[0], "local_voting, run 1 of 5: round 500 of 1000, 250 rounds/s, disagreement 0.25\n");
  watched.progress.run_begins({1, 0, Seed{2}}, kScalar);
  watched.now += 2s;
  watched.report(300, 1);
  ASSERT_EQ(watched.written.size(), 2u);
  EXPECT_EQ(watched.written[1], "local_voting, run 2 of 5: round 300 of 1000, 150 rounds/s, disagreement 0.25\n")
      << "speed goes on over the jobs";
}

TEST(Progress, LiveLineIsRedrawnTenTimesASecondAndFitsTheTerminal) {
  for (const std::size_t width : {20u, 60u, 80u, 200u}) {
    SCOPED_TRACE(width);
    TextStyle style = kTerminal;
    style.width = width;
    Watched watched(style);
    watched.progress.run_begins({0, 0, Seed{1}}, kScalar);
    for (Round k = 0; k <= 1000; ++k) {
      watched.now += 1ms;
      watched.report(k);
    }
    EXPECT_EQ(watched.written.size(), 10u);
    for (const auto& text : watched.written) {
      EXPECT_TRUE(text.starts_with("\r\x1b[K")) << text;
      EXPECT_EQ(text.find('\n'), std::string::npos) << text;
      EXPECT_LT(shown_width(text) - 4, width) << text;
    }
  }
}

TEST(Progress, NotesStandOnLinesOfTheirOwn) {
  Watched watched(kTerminal);
  watched.progress.launching(1, 0, 2);
  watched.progress.note("agent 2 died");
  watched.progress.finish();
  ASSERT_EQ(watched.written.size(), 3u);
  EXPECT_EQ(watched.written[1], "\r\x1b[K") << "the live line makes room";
  EXPECT_EQ(watched.written[2], "agent 2 died\n");
}

}  // namespace
}  // namespace consort
