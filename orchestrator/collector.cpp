#include "orchestrator/collector.hpp"

#include <algorithm>

namespace consort {

Collector::Collector(std::size_t agents, std::size_t dimension, Round rounds, Round report_interval)
    : agents_(agents), dimension_(dimension), rounds_(rounds), interval_(report_interval) {}

Round Collector::round_of(std::size_t number) const {
  return static_cast<Round>(std::min<std::uint64_t>(std::uint64_t{number} * interval_, rounds_));
}

void Collector::add(const wire::MemberReport& report) {
  const std::size_t agent = index_of(report.agent);
  if (agent >= agents_ || report.estimates.size() != report.rounds.size() * dimension_) {
    left_out_ += report.rounds.size();
    return;
  }
  for (std::size_t r = 0; r < report.rounds.size(); ++r) {
    const std::size_t number = number_of(report.rounds[r]);
    if (!is_reported(report.rounds[r]) || number < first_) {
      ++left_out_;
      continue;
    }
    while (rows_.size() <= number - first_) {
      if (spare_.empty()) {
        rows_.push_back({std::vector<double>(agents_ * dimension_), std::vector<std::uint64_t>(agents_),
                         std::vector<AgentCounters>(agents_), std::vector<bool>(agents_), 0});
      } else {
        rows_.push_back(std::move(spare_.back()));
        spare_.pop_back();
      }
    }
    Row& row = rows_[number - first_];
    if (row.here[agent]) {
      ++left_out_;
      continue;
    }
    row.here[agent] = true;
    ++row.count;
    std::copy_n(report.estimates.begin() + static_cast<std::ptrdiff_t>(r * dimension_), dimension_,
                row.estimates.begin() + static_cast<std::ptrdiff_t>(agent * dimension_));
    row.hashes[agent] = report.hashes[r];
    row.counters[agent] = report.counters[r];
  }
}

void Collector::hand_on(const std::function<bool(const RoundReport&)>& use) {
  while (!rows_.empty() && rows_.front().count == agents_) {
    Row& row = rows_.front();
    const bool more = use({round_of(first_), row.estimates, row.hashes, row.counters});
    row.count = 0;
    row.here.assign(agents_, false);
    spare_.push_back(std::move(row));
    rows_.pop_front();
    ++first_;
    if (!more) return;
  }
}

std::vector<AgentId> Collector::missing() const {
  std::vector<AgentId> agents;
  for (std::size_t i = 0; i < agents_; ++i) {
    if (rows_.empty() || !rows_.front().here[i]) agents.push_back(agent_at(i));
  }
  return agents;
}

}  // namespace consort
