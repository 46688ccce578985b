#pragma once
/// What a count in an experiment would need of the machine's memory, said before it is asked for.

#include <cstdint>
#include <string>

namespace consort {

/// Bytes this process may still take: of the host's, within the limits of the process and of its control group.
double memory_to_be_had();

/// "1.5 GB".
std::string bytes_text(double bytes);

/// Throws ConfigError "WHAT would take 1.5 TB of memory, and 20 GB can be had; allowed: REMEDY" if `bytes` are more than can be had.
void require_memory(double bytes, const std::string& what, const std::string& remedy, double to_be_had = memory_to_be_had());

/// What to say where memory has run out all the same: what can be had, and the largest need that was asked about before.
std::string out_of_memory();

}  // namespace consort
