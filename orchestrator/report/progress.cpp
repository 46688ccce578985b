#include "orchestrator/report/progress.hpp"

#include "core/stop.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace consort {
namespace {

constexpr auto kLivePeriod = std::chrono::milliseconds(100);
constexpr auto kPlainPeriod = std::chrono::seconds(1);
constexpr std::size_t kWidestBar = 24, kNarrowestBar = 6;

std::string bar(std::size_t width, double share, bool unicode) {
  const auto filled = static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(width));
  std::string out;
  for (std::size_t i = 0; i < width; ++i) out += i < filled ? (unicode ? "━" : "=") : (unicode ? "─" : ".");
  return out;
}

}  // namespace

Progress::Progress(const Experiment& experiment, TextStyle style, Write write, Clock clock)
    : experiment_(experiment), style_(style), write_(std::move(write)), clock_(std::move(clock)) {}

bool Progress::due(Time now) const { return !shown_ || now - *shown_ >= (style_.terminal ? Time::duration(kLivePeriod) : kPlainPeriod); }

void Progress::show(Time now, const std::string& live, const std::string& plain) {
  shown_ = now;
  if (style_.terminal)
    write_("\r\x1b[K" + clipped(live, style_.width > 1 ? style_.width - 1 : 1));  // the last column would wrap the line
  else
    write_(plain + "\n");
  live_line_ = style_.terminal;
}

void Progress::launching(std::size_t found, std::size_t ready, std::size_t total) {
  const Time now = clock_();
  // Without a terminal a launch that takes less than a second is told once, when it is complete.
  if (!mark_) mark_ = now;
  const bool complete = ready == total;
  if (!complete && (!due(now) || (!style_.terminal && now - *mark_ < kPlainPeriod))) return;
  const std::string text = fmt::format("found {} of {}, ready {} of {}", found, total, ready, total);
  show(now, "  " + text, text);
}

void Progress::run_begins(const Job& job, const Trace& outline) {
  agreement_ = outline;
  rounds_before_ += last_round_;
  last_round_ = 0;
  if (job.number == 0) mark_ = clock_();
}

void Progress::report(const Job& job, const RoundReport& report) {
  last_round_ = report.k;
  const Time now = clock_();
  // The first line waits a moment: round 0 has nothing to tell, and a short run ends before anybody could read it.
  if (!due(now) || !mark_ || now - *mark_ < kLivePeriod) return;
  const std::uint64_t rounds = rounds_before_ + last_round_;
  const double seconds = std::chrono::duration<double>(now - *mark_).count();
  const auto rate = static_cast<std::uint64_t>(static_cast<double>(rounds - rounds_at_mark_) / seconds);
  mark_ = now;
  rounds_at_mark_ = rounds;
  const std::string protocol = experiment_.protocols.at(job.protocol).title();
  const std::string run =
      experiment_.runs > 1 ? fmt::format("run {} of {}", job.number % experiment_.runs + 1, experiment_.runs) : std::string();
  // Only computed for what is shown: it compares all pairs of agents.
  const char* what = agreement_.truth == Truth::none ? "disagreement" : "error";
  const std::string figures = fmt::format("{} rounds/s, {} {:.3g}", grouped(rate), what, deviation(agreement_, report));
  show(now, live_text(run.empty() ? protocol : protocol + ", " + run, report.k, figures),
       fmt::format("{}{}: round {} of {}, {}", protocol, run.empty() ? "" : ", " + run, report.k, experiment_.rounds, figures));
}

std::string Progress::live_text(const std::string& before, Round k, const std::string& after) const {
  const std::string count = fmt::format("{:>{}}/{}", k, std::to_string(experiment_.rounds).size(), experiment_.rounds);
  const std::size_t used = 2 + shown_width(before) + 2 + count.size() + 2 + after.size() + 1;
  const std::size_t room = style_.width > used + 2 ? std::min(style_.width - used - 2, kWidestBar) : 0;
  const double share = experiment_.rounds > 0 ? static_cast<double>(k) / experiment_.rounds : 1.0;
  const std::string picture = room >= kNarrowestBar ? bar(room, share, style_.unicode) + "  " : "";
  return fmt::format("  {}  {}{}  {}", before, picture, count, after);
}

void Progress::note(std::string_view text) {
  finish();
  write_(std::string(text) + "\n");
}

void Progress::finish() {
  if (live_line_) write_("\r\x1b[K");
  live_line_ = false;
}

}  // namespace consort
