#include "process/run_member.hpp"

#include "core/errors.hpp"

#include <fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>

namespace consort {
namespace {

constexpr std::chrono::milliseconds kReportEvery{250};  // in real time
constexpr std::chrono::milliseconds kGreetSoon{15}, kGreetSeldom{500};

std::string host_name() {
  std::array<char, 64> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

// Reports that nobody is left to take, line by line.
void log_held(std::span<const MemberReport> reports) {
  for (const MemberReport& report : reports) {
    const std::size_t size = report.rounds.empty() ? 0 : report.estimates.size() / report.rounds.size();
    for (std::size_t r = 0; r < report.rounds.size(); ++r)
      spdlog::warn("held: agent {}, round {}: {}", report.agent.value, report.rounds[r],
                   fmt::join(std::span(report.estimates).subspan(r * size, size), " "));
  }
}

// What this process has used so far.
Performance usage(std::uint32_t process) {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
  Performance performance;
  performance.process = process;
  performance.cpu = seconds(used.ru_utime) + seconds(used.ru_stime);
  performance.resident_bytes = static_cast<std::uint64_t>(used.ru_maxrss) * 1024;
  return performance;
}

}  // namespace

RunMember::RunMember(const wire::Participant& participant, Arrival arrival, std::uint32_t process, std::vector<AgentId> agents)
    : process_(process),
      agents_(std::move(agents)),
      participant_(participant),
      telemetry_(participant),
      arrival_(std::move(arrival)),
      host_(host_name()),
      greet_again_(kGreetSoon),
      presence_(participant, liveliness_lease()) {}

void RunMember::interrupt(bool orphaned) {
  guarded([&] {
    interrupted_ = true;
    orphaned_ = orphaned;
    wake_.notify_one();
  });
}

void RunMember::run() {
  grants_.emplace(participant_, [this](Grant&& grant) { on_grant(std::move(grant)); });
  commands_.emplace(
      participant_, [this](wire::Command&& command) { on_command(command); }, [this](std::size_t n) { on_orchestrator(n); });
  Lock lock(mutex_);
  const auto end = [&] {
    ended_ = true;
    lock.unlock();
    pacer_.reset();
  };
  try {
    if (join_run(lock)) serve(lock);  // who is refused tells nobody: the run knows
  } catch (const std::exception& failure) {
    if (!lock.owns_lock()) lock.lock();
    say(lock, wire::State::failed, failure.what());
    end();
    presence_.wait_for_acknowledgments(2.0);
    throw;
  }
  say(lock, wire::State::leaving);
  end();
  if (liveliness_lease()) presence_.wait_for_acknowledgments(2.0);  // else it would seem to have died
}

void RunMember::on_grant(Grant&& grant) {
  guarded([&] {
    if (current(grant.epoch)) {
      reached_ = std::max(reached_, grant.reached);
      this->grant(grant);
      wake_.notify_one();  // it waits less patiently now, or may leave
    } else if (grant.epoch != epoch_) {
      granted_early_ = std::move(grant);
    }
  });
}

void RunMember::on_command(const wire::Command& command) {
  guarded([&] {
    switch (command.order) {
      case wire::Order::status:
        status_asked_ = true;
        break;
      case wire::Order::finish:
        finish_ = finish_ || command.epoch == epoch_;
        break;
      case wire::Order::shutdown:
        shutdown_ = true;
        break;
      case wire::Order::departed:
        if (command.epoch != epoch_)
          lost_early_ = command;
        else if (!finish_)
          depart(command.agents);
        break;
      case wire::Order::welcome:
        welcomed_ = welcomed_ || command.to == participant_.guid();
        break;
      case wire::Order::refused:
        if (!welcomed_ && command.to == participant_.guid()) refusal_ = command.note;
        break;
      case wire::Order::come_back:
        if (!current(command.epoch)) break;
        come_back(command.agents, command.round);
        ready_until_ = std::min(ready_until_, command.round);
        break;
    }
    wake_.notify_one();
  });
}

void RunMember::on_orchestrator(std::size_t writers) {
  guarded([&] {
    orchestrator_lost_ = writers == 0 && orchestrator_writers_ > 0 && !arrival_.launched;
    orchestrator_writers_ = writers;
    if (orchestrator_lost_) wake_.notify_one();
  });
}

void RunMember::greet_anew() {
  greeted_ = false;
  greet_again_ = kGreetSoon;
  wake_.notify_one();
}

void RunMember::start_clock(const Grant& grant, Seconds dt, Round first, Round last, std::vector<Seconds> phases) {
  if (pacer_) return;
  events_before_ = reader_events();
  pacer_.emplace(grant.start_ns, dt, first, last, std::move(phases), [this](std::size_t phase, Round k) {
    guarded([&] {
      if (!finish_) beat(phase, k);
    });
  });
}

bool RunMember::has_work() const {
  return failure_ || shutdown_ || interrupted_ || orchestrator_lost_ || status_asked_ || assigned_ || (finish_ && !finished_) ||
         (epoch_ && !finish_ && !finished_ && report_due()) || met_until() > ready_until_ || (!greeted_ && may_greet()) || more_to_do();
}

// A match is announced a moment before the connection is complete, so a greeting can be lost: it is repeated, at first soon, then less
// and less often, until rounds are granted.
void RunMember::wait_for_work(Lock& lock) {
  const auto work = [this] { return has_work(); };
  if (pacer_) {
    if (!wake_.wait_for(lock, kReportEvery, work) && !finish_) send_reports(lock, false);
    if (greeting_needed()) greeted_ = false;
    return;
  }
  const bool greets = greeting_needed(), asks = epoch_ && !finish_;
  if (!greets && !asks) return wake_.wait(lock, work);
  Patience::Duration pause = asks ? patience_.wait() : greet_again_;
  if (greets) pause = std::min<Patience::Duration>(pause, greeted_at_ + greet_again_ - now());
  if (wake_.wait_for(lock, pause, work)) return;
  if (asks) ask_if_stuck();
  if (!greets || now() < greeted_at_ + greet_again_) return;
  greet_again_ = std::min(2 * greet_again_, kGreetSeldom);
  greeted_at_ = now();
  greeted_ = false;
}

// In lockstep whatever has been lost is asked for where the next message shows it, or here, where no next one comes.
void RunMember::ask_if_stuck() {
  if (const std::uint64_t before = std::exchange(seen_twice_, came_twice()); seen_twice_ > before) patience_.was_hasty();
  if (const std::uint64_t before = std::exchange(seen_heard_, heard()); seen_heard_ != before) return;
  const int asked = patience_.asked();
  if (!ask())
    has_gone_on();
  else if (patience_.asked() == asked)
    has_asked();  // it has only said how far it is
}

void RunMember::serve(Lock& lock) {
  while (true) {
    wait_for_work(lock);
    if (failure_) std::rethrow_exception(failure_);
    if ((orphaned_ || orchestrator_lost_) && epoch_) log_held(held_reports());
    if (shutdown_ || interrupted_) return;
    if (orchestrator_lost_) lose_orchestrator();
    if (assigned_) start_run(lock);
    if (!do_more(lock)) return;  // and neither greets nor is ready any more
    if (!greeted_ && may_greet()) {
      greeted_ = true;
      greeted_at_ = now();
      greet();
    }
    if (const Round until = met_until(); until > ready_until_) {
      ready_until_ = until;
      say(lock, wire::State::ready);
    }
    if (epoch_ && !finish_ && !finished_ && report_due()) send_reports(lock, false);
    if (finish_) send_last_report(lock);
    if (std::exchange(status_asked_, false)) say(lock, wire::State::status);
  }
}

void RunMember::start_run(Lock& lock) {
  lock.unlock();
  pacer_.reset();
  lock.lock();
  assigned_ = finish_ = finished_ = false;
  greet_again_ = kGreetSoon;
  epoch_ = newest_epoch_;
  ready_until_ = reached_ = 0;
  begin_run(lock);
}

void RunMember::send_reports(Lock& lock, bool last) {
  wire::Telemetry telemetry{process_, *epoch_, last, {}, {}, participant_.take_refusals()};
  if (!fill(telemetry) && telemetry.refusals.empty()) return;
  if (last) telemetry.performance = performance();
  lock.unlock();
  telemetry_.write(telemetry);
  lock.lock();
}

void RunMember::send_last_report(Lock& lock) {
  if (!std::exchange(finished_, true)) send_reports(lock, true);
}

Performance RunMember::performance() const {
  Performance performance = usage(process_);
  if (pacer_) pacer_->add_to(performance);
  performance.missed_inputs = missed_inputs();
  performance.sent_again_bytes = presence_.sent_again_bytes() + telemetry_.sent_again_bytes() + sent_again_bytes();
  const wire::ReaderEvents events = reader_events() - events_before_;
  performance.dds_deadlines_missed = events.deadlines_missed;
  performance.liveliness_lost = events.liveliness_lost;
  return performance;
}

void RunMember::say(Lock& lock, wire::State state, const std::string& note) {
  wire::Presence presence;
  presence.process = process_;
  presence.epoch = epoch_.value_or(0);
  presence.state = state;
  presence.pid = static_cast<std::uint64_t>(getpid());
  presence.host = host_;
  presence.agents = agents_;
  presence.note = note;
  if (state == wire::State::status && met_until() == 0)
    presence.note = unmet();
  else if (epoch_)
    describe(presence);
  if (state == wire::State::ready) presence.round = ready_until_;
  constexpr std::array kWords{"hello", "met everybody", "asked for status", "failed", "leaving"};
  spdlog::info("epoch {}: {}{}", presence.epoch, kWords[static_cast<std::size_t>(state)],
               presence.note.empty() ? "" : ": " + presence.note);
  lock.unlock();
  presence_.write(presence);
  lock.lock();
}

}  // namespace consort
