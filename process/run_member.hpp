#pragma once
/// What every process of a run has in common once it is on DDS: work on receive threads under one lock, a main thread that waits for
/// something to do, commands of the orchestrator, and its disappearance.

#include "idl/wire.hpp"

#include <fmt/ranges.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace consort {

/// A process that no parent waits for shows so often that it is alive, and is gone when it has not for so long (s).
constexpr double kSignOfLifeEvery = 0.15, kSignOfLifeLease = 0.7;

/// How a process comes into its run.
struct Meeting {
  bool launched = false;  ///< by an orchestrator on this host, which waits for it and whose death is noticed by other means than DDS
  double wait = 60.0;     ///< s; who is not launched gives up when it has met nobody by then; 0: never
  std::string sought = "its run";  ///< what it looks for, for a person
};

class RunMember {
 public:
  RunMember(const RunMember&) = delete;
  RunMember& operator=(const RunMember&) = delete;
  virtual ~RunMember() = default;
  /// Serves run after run until the orchestrator says shutdown. Throws RunError if the orchestrator disappears or the physics diverges,
  /// ConfigError or RunError if an assignment cannot be carried out (the orchestrator has been told by then).
  virtual void run() = 0;
  /// Ends run() from a signal handler's thread. `orphaned`: because the orchestrator is gone.
  void interrupt(bool orphaned) {
    guarded([&] {
      interrupted_ = true;
      orphaned_ = orphaned;
      wake_.notify_one();
    });
  }

 protected:
  using Lock = std::unique_lock<std::mutex>;
  static constexpr std::uint32_t kGreeting = 0;  ///< epoch of a greeting; those of runs count from 1

  RunMember(const wire::Participant& participant, Meeting meeting) : participant_(participant), meeting_(std::move(meeting)) {}

  /// Says hello until the orchestrator has answered: who is not launched may be one too many, and does nothing before. False: it is to end.
  /// Throws RunError saying why if the run does not want this process, TimeoutError if there is no run for so long.
  bool meet_run(Lock& lock);
  /// Who would have waited for its run for ever will meet the next one, once somebody starts it again: its exit code says so.
  [[noreturn]] void lose_orchestrator() const;
  virtual void say_hello(Lock& lock) = 0;
  /// For the log.
  virtual void tell(const std::string& line) const = 0;

  /// For Presence.
  [[nodiscard]] std::optional<double> liveliness_lease() const {
    return meeting_.launched ? std::nullopt : std::optional(kSignOfLifeLease);
  }

  /// These agents are gone; called under the lock.
  virtual void depart(std::span<const AgentId> agents) = 0;
  /// These agents take part again from that round on, and want to be met; called under the lock.
  virtual void come_back(std::span<const AgentId> agents, Round round) = 0;

  /// Runs under the lock, until run() has ended; a failure is kept for the main thread.
  template <class Work>
  void guarded(Work&& work) {
    const Lock lock(mutex_);
    if (ended_) return;  // what it would use is being taken down
    try {
      work();
    } catch (...) {  // must not cross DDS's C code: the main thread rethrows it
      if (!failure_) failure_ = std::current_exception();
      wake_.notify_one();
    }
  }

  void on_command(const wire::Command& command) {
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
          if (command.epoch == epoch_ && !finish_) come_back(command.agents, command.round);
          break;
      }
      wake_.notify_one();
    });
  }

  /// Reports that nobody is left to take, line by line for the log.
  static std::vector<std::string> in_words(std::span<const MemberReport> reports) {
    std::vector<std::string> lines;
    for (const MemberReport& report : reports) {
      const std::size_t size = report.rounds.empty() ? 0 : report.estimates.size() / report.rounds.size();
      for (std::size_t r = 0; r < report.rounds.size(); ++r)
        lines.push_back(fmt::format("held: agent {}, round {}: {}", report.agent.value, report.rounds[r],
                                    fmt::join(std::span(report.estimates).subspan(r * size, size), " ")));
    }
    return lines;
  }

  /// What this process has used so far.
  static Performance usage(std::uint32_t process) {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    const auto seconds = [](const timeval& time) { return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec); };
    Performance performance;
    performance.process = process;
    performance.cpu = seconds(used.ru_utime) + seconds(used.ru_stime);
    performance.resident_bytes = static_cast<std::uint64_t>(used.ru_maxrss) * 1024;
    return performance;
  }

  void on_orchestrator(std::size_t writers) {
    guarded([&] {
      orchestrator_lost_ = writers == 0 && orchestrator_writers_ > 0 && !meeting_.launched;
      orchestrator_writers_ = writers;
      if (orchestrator_lost_) wake_.notify_one();
    });
  }

  /// For has_work: waits for it, but for no longer than until the next greeting; false then. The first one comes soon, later ones less and
  /// less often.
  template <class HasWork>
  bool wait_or_greet(Lock& lock, HasWork&& has_work) {
    if (wake_.wait_for(lock, greet_again_, std::forward<HasWork>(has_work))) return true;
    greet_again_ = std::min(2 * greet_again_, kGreetSeldom);
    return false;
  }

  std::mutex mutex_;  // guards everything below, and what the derived class says it guards
  std::condition_variable wake_;
  std::exception_ptr failure_;
  std::optional<std::uint32_t> epoch_;                           // of the run being served
  std::optional<wire::Command> lost_early_;                      // `departed`, of a run that has not begun here
  static constexpr std::chrono::milliseconds kReportEvery{250};  // in real time
  static constexpr std::chrono::milliseconds kGreetSoon{15}, kGreetSeldom{500};
  std::chrono::milliseconds greet_again_ = kGreetSoon;
  bool finish_ = false, finished_ = false, status_asked_ = false, shutdown_ = false, interrupted_ = false, orphaned_ = false,
       orchestrator_lost_ = false, ended_ = false;

  wire::Participant participant_;

 private:
  [[nodiscard]] std::string objection_to_orchestrators() const;

  Meeting meeting_;
  std::size_t orchestrator_writers_ = 0;
  bool welcomed_ = false;
  std::string refusal_;  // the run's reason not to want this process
};

}  // namespace consort
