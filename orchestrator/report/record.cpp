#include "orchestrator/report/record.hpp"

#include "core/errors.hpp"
#include "orchestrator/report/record_writer.hpp"
#include "orchestrator/script/script.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <future>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

namespace consort {

namespace {

constexpr std::size_t kMaxPendingDoubles = 8u << 20;            // 64 MiB waiting for the disk; beyond that the run waits
constexpr std::size_t kEagerDoubles = kMaxPendingDoubles / 8;   // start writing before the period is over
constexpr auto kCommitPeriod = std::chrono::milliseconds(100);  // seldom enough to leave the cores to the agents
constexpr int kLeastPriority = 19;                              // nice value

}  // namespace

struct Record::Impl {
  Impl(const std::filesystem::path& file, const Experiment& about) : experiment(about), writer(file, about) {
    // The task's future carries the writer's failure to whoever asks next.
    finished = std::async(std::launch::async, [this] { write_until_closed(); }).share();
  }

  ~Impl() {
    {
      const std::lock_guard lock(mutex);
      hand_over_agents();
      closing = true;
    }
    wake.notify_all();
    finished.wait();
  }

  void write_until_closed() {
    // Whoever waits must learn that nobody writes any more, also when an exception ends this thread.
    struct Stopped {
      Impl& impl;
      ~Stopped() {
        const std::lock_guard lock(impl.mutex);
        impl.stopped = true;
        impl.progress.notify_all();
      }
    } stopped_on_return{*this};
    // The record takes what the agents leave of the cores: it has a quarter of a second and more for what agents wait microseconds for.
    setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kLeastPriority);
    recording::Batch batch;
    for (;;) {
      {
        std::unique_lock lock(mutex);
        wake.wait_for(lock, kCommitPeriod, [&] { return closing || urgent || pending.values.size() >= kEagerDoubles; });
        if (closing && pending.entries.empty()) return;
        urgent = false;
        std::swap(batch, pending);
      }
      progress.notify_all();
      const auto keep_newest = [this](const recording::Rows& rows) {
        const std::lock_guard lock(mutex);
        newest = std::pair(rows.run, rows.round);
      };
      if (!batch.entries.empty()) writer.write(batch, keep_newest);
      const std::lock_guard lock(mutex);
      committed += batch.entries.size();
      batch.clear();
      progress.notify_all();
    }
  }

  template <class Entry>
  void hand_over(Entry&& entry) {  // call with the mutex held
    pending.entries.emplace_back(std::forward<Entry>(entry));
    ++handed;
  }

  // Counts of the run that is going on; they are written when it ends, and on closing if it never does. Call with the mutex held.
  void hand_over_agents() {
    if (current.counters.empty()) return;
    pending.entries.emplace_back(std::move(current));
    ++handed;
    current = {};
  }

  std::unique_lock<std::mutex> lock_for_writing() {
    std::unique_lock lock(mutex);
    progress.wait(lock, [&] { return stopped || pending.values.size() < kMaxPendingDoubles; });
    rethrow_failure();
    return lock;
  }

  void rethrow_failure() {
    if (stopped) finished.get();
  }

  const Experiment& experiment;
  recording::Writer writer;
  std::mutex mutex;
  std::condition_variable wake, progress;
  recording::Batch pending;
  recording::AgentRows current{};
  std::uint64_t handed = 0, committed = 0;
  std::optional<std::pair<std::size_t, Round>> newest;  // run and round of the newest report that is on the disk
  bool closing = false, urgent = false, stopped = false;
  std::shared_future<void> finished;
};

Record::Record(const std::filesystem::path& file, const Experiment& experiment) : impl_(std::make_unique<Impl>(file, experiment)) {}
Record::~Record() = default;

void Record::begin_run(const Job& job, const Trace& outline) {
  const Experiment& experiment = impl_->experiment;
  const ProtocolChoice& choice = experiment.protocols.at(job.protocol);
  std::vector<RecordColumn> columns = columns_of(choice, experiment, outline);
  check(columns.size() <= kMostRecorded, "the reader has refused what the record cannot hold");
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  impl_->current.run = job.number;
  impl_->hand_over(recording::Begin{job, choice.title(), recording::utc_now(), std::move(columns)});
}

void Record::add(const Job& job, const RoundReport& report) {
  const auto lock = impl_->lock_for_writing();
  const std::size_t agents = report.counters.size();
  auto& values = impl_->pending.values;
  const std::array parts{report.estimates, report.recorded, report.states};
  std::size_t width = 0;
  for (const auto& part : parts) width += agents == 0 ? 0 : part.size() / agents;
  impl_->hand_over(recording::Rows{job.number, report.k, agents, width, values.size()});
  for (std::size_t i = 0; i < agents; ++i) {
    for (const auto& part : parts) {
      const auto of_agent = part.subspan(i * (part.size() / agents), part.size() / agents);
      values.insert(values.end(), of_agent.begin(), of_agent.end());
    }
  }
  impl_->current.counters.assign(report.counters.begin(), report.counters.end());
  impl_->current.hashes.assign(report.hashes.begin(), report.hashes.end());
  if (values.size() >= kEagerDoubles) impl_->wake.notify_one();
}

void Record::event(const Job& job, Round round, const std::string& kind, const std::string& text) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over(recording::Happened{job.number, round, kind, text});
}

void Record::end_run(const JobOutcome& outcome, const Metrics& metrics) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  const Trace& trace = outcome.trace;
  impl_->hand_over(recording::End{outcome.job.number, trace.last_round, trace.converged, outcome.seconds, trace.totals, trace.hash,
                                  is_complete(outcome.end.ending) ? recording::utc_now() : std::string(), trace.links, trace.network,
                                  trace.processes, metrics});
}

void Record::conclude(const Summary& summary) {
  const auto lock = impl_->lock_for_writing();
  impl_->hand_over_agents();
  impl_->hand_over(summary);
}

std::string Record::saved() const {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->newest) return "no report";
  const auto [run, round] = *impl_->newest;
  return fmt::format("the reports up to round {}{}", round, run == 0 ? std::string() : fmt::format(" of run {}", run));
}

void Record::flush() {
  std::unique_lock lock(impl_->mutex);
  const std::uint64_t mark = impl_->handed;
  impl_->urgent = true;
  impl_->wake.notify_all();
  impl_->progress.wait(lock, [&] { return impl_->stopped || impl_->committed >= mark; });
  impl_->rethrow_failure();
}

}  // namespace consort
