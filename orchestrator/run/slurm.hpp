#pragma once
/// The hosts of the Slurm allocation that this program runs in.

#include "orchestrator/script/hosts.hpp"

#include <cstddef>
#include <string>
#include <vector>

namespace consort {

/// "2(x3),1" as Slurm says it of its nodes: 2, 2, 2, 1. Throws ConfigError that names `variable`. Pure.
std::vector<std::size_t> tasks_per_node(const std::string& variable, const std::string& text);

/// Each node, with as many slots as it has tasks, `consort` being this very program. Throws ConfigError outside an allocation.
std::vector<Host> hosts_of_allocation();

}  // namespace consort
