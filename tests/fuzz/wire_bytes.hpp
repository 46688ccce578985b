#pragma once
/// Bytes as they come from the network, through DDS's own deserialiser and the decoder of their topic.

#include <cstdint>
#include <span>
#include <vector>

namespace consort::fuzz {

enum class Fate {
  malformed,  ///< DDS would drop it: the bytes are not a sample of the type
  rejected,   ///< a bound is broken
  decoded,
};

/// The first byte chooses the topic, the rest is CDR. Throws whatever decode() throws except Rejected, and std::logic_error where what was
/// decoded cannot be sent on.
Fate take_wire_bytes(std::span<const std::uint8_t> bytes);

/// Valid inputs, one of every topic at least.
std::vector<std::vector<std::uint8_t>> wire_seeds();

}  // namespace consort::fuzz
