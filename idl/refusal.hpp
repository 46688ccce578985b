#pragma once
/// What a process of a run received and would not take.

#include <array>
#include <cstdint>
#include <string>

namespace consort {

/// Samples of one writer that were left out, and why.
struct Refusal {
  enum class Reason : std::uint8_t {
    stranger,   ///< the writer does not know the run's key
    bound,      ///< the writer belongs to the run, but the sample breaks a bound of the wire
    malformed,  ///< DDS itself could not read it; whose it is nobody knows
    key,        ///< the writer is a process of Consort that was started with another key
    build,      ///< the writer is a process of Consort of another build
  };
  std::string topic;
  Reason reason = Reason::stranger;
  std::string field;   ///< bound: the first field that breaks one
  std::string writer;  ///< GUID of the writer's participant, 32 hexadecimal digits; empty where discovery had forgotten it
  std::string who;     ///< the process behind it, for a person; empty where discovery does not know
  std::uint64_t samples = 0;

  /// Does it tell of the same as `other`, apart from the number of samples?
  [[nodiscard]] bool same(const Refusal& other) const {
    return reason == other.reason && topic == other.topic && field == other.field && writer == other.writer;
  }
};

inline const char* word(Refusal::Reason reason) {
  constexpr std::array kWords{"stranger", "bound", "malformed", "key", "build"};
  return kWords.at(static_cast<std::size_t>(reason));
}

}  // namespace consort
