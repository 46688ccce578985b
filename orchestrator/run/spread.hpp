#pragma once
/// Which host of a run each of its processes is on. Pure.

#include "orchestrator/run/placement.hpp"
#include "orchestrator/script/hosts.hpp"

#include <cstddef>
#include <vector>

namespace consort {

/// The host `consort run` itself is on.
inline constexpr std::size_t kHere = static_cast<std::size_t>(-1);

/// By process, the plant last if there is one: the index of its host, or kHere. Hosts that name their agents have these; the others are
/// filled by their slots, in their order, each with a block of processes that talk to each other as far as can be. A plant that nobody
/// names is here. Throws ConfigError that begins "hosts: " if they do not suffice.
std::vector<std::size_t> spread(const Experiment& experiment, const Placement& placement, const std::vector<Host>& hosts);

}  // namespace consort
