#pragma once
/// Files that the user names: read whole, within bounds of size and time, whatever stands behind the name.

#include <chrono>
#include <cstddef>
#include <filesystem>
#include <string>

namespace consort {

inline constexpr std::size_t kLargestInput = std::size_t{64} << 20;  ///< bytes
inline constexpr std::chrono::seconds kPipePatience{10};             ///< with a pipe that gives nothing; six times that for all it gives

/// What the file holds. A pipe (`<(generator)`, a FIFO) is read until its writer closes it. Throws ConfigError, without the file's name, on
/// a folder, a device, more than `most` bytes, a pipe that gives nothing for `patience` or does not end, and what cannot be read.
std::string read_input(const std::filesystem::path& file, std::size_t most = kLargestInput,
                       std::chrono::milliseconds patience = kPipePatience);

}  // namespace consort
