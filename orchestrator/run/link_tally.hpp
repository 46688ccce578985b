#pragma once
/// What the processes of a run have told of their links, added up by link. Each tells what it has counted since it was started, again and
/// again where it may be gone before its last words; the newest counts. Pure.

#include "idl/wire.hpp"

#include <map>
#include <vector>

namespace consort {

class LinkTally {
 public:
  void add(const wire::Telemetry& telemetry) {
    if (telemetry.last || !telemetry.links.empty() || !telemetry.network.empty())
      newest_[telemetry.process] = {telemetry.links, telemetry.network};
    if (telemetry.last) conclude(telemetry.process);
  }
  /// What it has told counts; whoever is started in its place counts from nothing.
  void conclude(std::uint32_t process) {
    const auto told = newest_.find(process);
    if (told == newest_.end()) return;
    add(told->second, ended_);
    newest_.erase(told);
  }
  /// Ascending by edge.
  [[nodiscard]] std::vector<LinkTotals> links() const { return listed(sum().links); }
  [[nodiscard]] std::vector<NetworkTotals> network() const { return listed(sum().network); }

 private:
  struct Told {
    std::vector<LinkTotals> links;
    std::vector<NetworkTotals> network;
  };
  struct Sums {
    std::map<Edge, LinkCounters> links;
    std::map<Edge, NetworkCounters> network;
  };
  static void add(const Told& told, Sums& sums) {
    for (const auto& [edge, counters] : told.links) sums.links[edge] += counters;
    for (const auto& [edge, counters] : told.network) sums.network[edge] += counters;
  }
  [[nodiscard]] Sums sum() const {
    Sums all = ended_;
    for (const auto& [process, told] : newest_) add(told, all);
    return all;
  }
  template <class Counters>
  static std::vector<OfLink<Counters>> listed(const std::map<Edge, Counters>& sums) {
    std::vector<OfLink<Counters>> list;
    for (const auto& [edge, counters] : sums) list.push_back({edge, counters});
    return list;
  }

  std::map<std::uint32_t, Told> newest_;  // by process
  Sums ended_;                            // of processes that have ended
};

}  // namespace consort
