#include "orchestrator/run/collector.hpp"

#include <algorithm>

namespace consort {

Collector::Collector(std::size_t agents, std::size_t dimension, Round rounds, Round report_interval, std::size_t state_dimension,
                     const std::map<AgentId, Attendance>& presence, std::size_t recorded_dimension)
    : agents_(agents),
      dimension_(dimension),
      state_dimension_(state_dimension),
      recorded_dimension_(recorded_dimension),
      rounds_(rounds),
      interval_(report_interval),
      presence_(presence) {
  for (const auto& [agent, attendance] : presence_)
    for (const Attendance& stay : attendance.stays()) ends_.insert(stay.until);
}

Round Collector::round_of(std::size_t number) const {
  return static_cast<Round>(std::min<std::uint64_t>(std::uint64_t{number} * interval_, rounds_));
}

Attendance Collector::attendance_of(AgentId agent) const {
  const auto at = presence_.find(agent);
  return at == presence_.end() ? Attendance{} : at->second;
}

void Collector::fill_absent(Half& half, AgentId agent, const Last& last) {
  const std::size_t index = index_of(agent);
  if (half.here[index]) return;
  for (std::vector<double>* numbers : {&half.numbers, &half.recorded}) {
    const std::size_t dimension = numbers->size() / half.here.size();
    std::fill_n(numbers->begin() + static_cast<std::ptrdiff_t>(index * dimension), dimension, kAbsent);
  }
  half.hashes[index] = last.hash;
  half.counters[index] = last.counters;
  half.here[index] = true;
  ++half.count;
}

Collector::Half Collector::new_half(Round k, std::size_t dimension, std::size_t recorded, const LastWords& last) const {
  Half half{std::vector<double>(agents_ * dimension),
            std::vector<double>(agents_ * recorded),
            std::vector<std::uint64_t>(agents_),
            std::vector<AgentCounters>(agents_),
            std::vector<bool>(agents_),
            0};
  for (const auto& [agent, attendance] : presence_) {
    if (attendance.holds(k)) continue;
    if (k < attendance.from) {
      fill_absent(half, agent, {HistoryHash{}.value(), {}});
      continue;
    }
    Round ended = attendance.until;
    for (const Attendance& stay : attendance.again)
      if (stay.until <= k) ended = stay.until;
    const auto words = last.find(agent);
    if (words == last.end()) continue;
    if (const auto left = words->second.find(ended); left != words->second.end()) fill_absent(half, agent, left->second);
  }
  return half;
}

Collector::Row Collector::new_row(Round k) const {
  Half agents = new_half(k, dimension_, recorded_dimension_, last_agents_);
  for (const auto& [agent, departures] : departed_)
    for (const Departed& gone : departures)
      if (k >= gone.from && k < gone.until) fill_absent(agents, agent, gone.last);
  return {std::move(agents), state_dimension_ > 0 ? new_half(k, state_dimension_, 0, last_plant_) : Half{}};
}

void Collector::depart(std::span<const AgentId> agents) {
  for (const AgentId agent : agents) {
    const auto newest = newest_.find(agent);
    Departed gone = newest == newest_.end() ? Departed{0, {HistoryHash{}.value(), {}}} : newest->second;
    std::vector<Departed>& departures = departed_[agent];
    if (!departures.empty() && gone.from < departures.back().until) continue;  // known
    for (const Attendance& stay : attendance_of(agent).again)
      if (stay.from > gone.from) gone.until = std::min(gone.until, stay.from);
    departures.push_back(gone);
    last_agents_[agent].emplace(gone.from, gone.last);
    for (std::size_t r = 0; r < rows_.size(); ++r)
      if (round_of(first_ + r) >= gone.from && round_of(first_ + r) < gone.until) fill_absent(rows_[r].agents, agent, gone.last);
  }
}

// An agent has said the last word of a stay: it holds until it comes back.
void Collector::set_last(AgentId agent, const Attendance& stay, const Last& last, bool of_plant) {
  (of_plant ? last_plant_ : last_agents_)[agent].emplace(stay.until, last);
  const Attendance attendance = attendance_of(agent);
  for (std::size_t r = 0; r < rows_.size(); ++r)
    if (round_of(first_ + r) >= stay.until && !attendance.holds(round_of(first_ + r)))
      fill_absent(of_plant ? rows_[r].plant : rows_[r].agents, agent, last);
}

AgentCounters Collector::of_earlier_stays(AgentId agent, Round k) const {
  const auto words = last_agents_.find(agent);
  if (words == last_agents_.end()) return {};
  const auto after = words->second.lower_bound(k);  // a stay that ends in round k is the one that speaks
  return after == words->second.begin() ? AgentCounters{} : std::prev(after)->second.counters;
}

void Collector::add(const MemberReport& report, bool of_plant) {
  const std::size_t agent = index_of(report.agent), dimension = of_plant ? state_dimension_ : dimension_,
                    recorded = of_plant ? 0 : recorded_dimension_;
  if (agent >= agents_ || report.estimates.size() != report.rounds.size() * dimension ||
      report.recorded.size() != report.rounds.size() * recorded || (of_plant && state_dimension_ == 0)) {
    left_out_ += report.rounds.size();
    return;
  }
  const Attendance attendance = attendance_of(report.agent);
  const std::vector<Attendance> stays = attendance.stays();
  for (std::size_t r = 0; r < report.rounds.size(); ++r) {
    const Round k = report.rounds[r];
    AgentCounters counters = report.counters[r];
    if (!of_plant) counters += of_earlier_stays(report.agent, k);
    const auto ended = std::find_if(stays.begin(), stays.end(), [k](const Attendance& stay) { return stay.until == k; });
    if (ended != stays.end()) {
      update_progress(report.agent, k, report.slept, of_plant);
      set_last(report.agent, *ended, {report.hashes[r], counters}, of_plant);
      continue;
    }
    const std::size_t number = number_of(k);
    if (!is_reported(k) && ends_.contains(k)) continue;
    if (!is_reported(k) || number < first_ || !attendance.holds(k)) {
      ++left_out_;
      continue;
    }
    while (rows_.size() <= number - first_) rows_.push_back(new_row(round_of(first_ + rows_.size())));
    update_progress(report.agent, k, report.slept, of_plant);
    Half& half = of_plant ? rows_[number - first_].plant : rows_[number - first_].agents;
    if (half.here[agent]) {
      left_out_ += ends_.contains(k) ? 0 : 1;
      continue;
    }
    half.here[agent] = true;
    ++half.count;
    std::copy_n(report.estimates.begin() + static_cast<std::ptrdiff_t>(r * dimension), dimension,
                half.numbers.begin() + static_cast<std::ptrdiff_t>(agent * dimension));
    std::copy_n(report.recorded.begin() + static_cast<std::ptrdiff_t>(r * recorded), recorded,
                half.recorded.begin() + static_cast<std::ptrdiff_t>(agent * recorded));
    half.hashes[agent] = report.hashes[r];
    if (!of_plant) newest_[report.agent] = {k + 1, {report.hashes[r], counters}};
    half.counters[agent] = counters;
  }
}

void Collector::update_progress(AgentId agent, Round k, std::uint64_t slept, bool of_plant) {
  if (of_plant) {
    plant_reached_ = std::max(plant_reached_, k);
    return;
  }
  Progress& progress = progress_[agent];
  progress.reached = std::max(progress.reached, k);
  const std::vector<Attendance> stays = attendance_of(agent).stays();
  const auto stay = std::find_if(stays.begin(), stays.end(), [k](const Attendance& each) { return k <= each.until; });
  if (stay == stays.end()) return;
  std::uint64_t& known = progress.slept[stay->until];
  known = std::max(known, slept);
}

Round Collector::reached(AgentId agent) const {
  const auto at = progress_.find(agent);
  return at == progress_.end() ? 0 : at->second.reached;
}

std::uint64_t Collector::slept(AgentId agent) const {
  std::uint64_t sum = 0;
  if (const auto at = progress_.find(agent); at != progress_.end())
    for (const auto& [until, slept] : at->second.slept) sum += slept;
  return sum;
}

void Collector::hand_on(const std::function<bool(const RoundReport&)>& use) {
  const auto complete = [this](const Row& row) {
    return row.agents.count == agents_ && (state_dimension_ == 0 || row.plant.count == agents_);
  };
  // Where nobody is there, nobody reports: such rows come of themselves.
  const auto begin_next = [this] {
    if (rows_.empty() && (first_ == 0 || round_of(first_ - 1) < rounds_)) rows_.push_back(new_row(round_of(first_)));
    return !rows_.empty();
  };
  while (begin_next() && complete(rows_.front())) {
    Row row = std::move(rows_.front());
    rows_.pop_front();
    const Round k = round_of(first_++);
    for (const auto& [agent, departures] : departed_)
      if (state_dimension_ > 0 &&
          std::any_of(departures.begin(), departures.end(), [k](const Departed& gone) { return k >= gone.from && k < gone.until; }))
        std::fill_n(row.plant.numbers.begin() + static_cast<std::ptrdiff_t>(index_of(agent) * state_dimension_), state_dimension_, kAbsent);
    if (!use({k, row.agents.numbers, row.agents.hashes, row.agents.counters, row.plant.numbers, row.plant.hashes, row.agents.recorded}))
      return;
  }
}

std::vector<AgentId> Collector::missing() const {
  std::vector<AgentId> agents;
  for (std::size_t i = 0; i < agents_; ++i) {
    if (rows_.empty() || !rows_.front().agents.here[i]) agents.push_back(agent_at(i));
  }
  return agents;
}

}  // namespace consort
