#pragma once
/// What the processes of a run are told at the beginning of a job, and whoever comes later: made of the experiment and its placement. Pure.

#include "core/messages.hpp"
#include "orchestrator/run/placement.hpp"
#include "orchestrator/run/run.hpp"
#include "rounds/agent_maker.hpp"

#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace consort {

class Assignments {
 public:
  /// `experiment` and `placement` must outlive this. Throws ConfigError where the protocol or the plant refuses its values.
  Assignments(const Experiment& experiment, const Placement& placement, const Job& job, std::uint32_t epoch);

  /// What is told in round `now` to the agents of the processes that are meant, in parts of bounded size. `gone`: agents that are lost,
  /// ascending.
  [[nodiscard]] std::vector<Assignment> agents(const std::function<bool(std::size_t process)>& meant, Round now = 0,
                                               std::span<const AgentId> gone = {}) const;
  /// What the plant is told, in parts of bounded size.
  [[nodiscard]] std::vector<PlantAssignment> plant() const;
  /// The trace of this job before its first report.
  [[nodiscard]] const Trace& outline() const { return outline_; }

 private:
  [[nodiscard]] Assignment common(Round now, std::span<const AgentId> gone) const;
  [[nodiscard]] MemberTask member(AgentId agent, Round now) const;
  void count_readers(MemberTask& member, Round now) const;
  [[nodiscard]] Round measured_ahead() const;
  [[nodiscard]] const ProtocolChoice& protocol() const { return experiment_.protocols[job_.protocol]; }

  const Experiment& experiment_;
  const Placement& placement_;
  Job job_;
  std::uint32_t epoch_;
  AgentMaker maker_;
  std::vector<std::vector<Told>> told_;  // by agent: whose announcements reach it; empty where nobody announces anything
  bool steers_ = false;                  // the agents steer the plant
  Round ahead_ = 1;                      // how far ahead of its listeners an agent may be
  Trace outline_;
};

}  // namespace consort
