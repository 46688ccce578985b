#pragma once
/// Where and with what a run was made: kept beside its results, so that a number can be traced to the programs that gave it.

#include "core/experiment.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace consort {

/// seed, versions (Consort and its commit, Cyclone DDS, Eigen, SQLite, compiler, kernel), cores, memory, command line.
nlohmann::ordered_json host_facts(const Experiment& experiment, const std::vector<std::string>& command_line);

std::string host_name();
/// The folder this program lies in, and with it the others of a run. Throws RunError.
std::filesystem::path program_folder();
/// That this host is short of processor time, where it is, and what to do then; else empty.
std::string too_busy();

}  // namespace consort
