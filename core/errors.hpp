#pragma once
/// Three kinds of failure: a caller's bug, a user's mistake, the world. `main` is the only place that catches them.

#include <stdexcept>
#include <string>
#include <string_view>

namespace consort {

/// Process exit codes of every Consort executable.
enum class Exit : int { ok = 0, criterion_not_met = 1, bad_input = 2, run_failed = 3, timed_out = 4, interrupted = 130, terminated = 143 };

/// A caller broke a contract. Never caught on purpose; it names the contract.
struct ContractViolation : std::logic_error {
  using std::logic_error::logic_error;
};

/// A mistake in what the user wrote; the text names the place, what was found and what is allowed.
struct ConfigError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The world failed (DDS, a process, numerics); the text names the thing: agent, process, signal, or matrix, size, condition.
struct RunError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// The run's deadline passed; the text says who was waiting for whom.
struct TimeoutError : RunError {
  using RunError::RunError;
};

/// Holds in all builds. Throws ContractViolation with `text`.
inline void check(bool condition, std::string_view text) {
  if (!condition) throw ContractViolation(std::string(text));
}

}  // namespace consort
