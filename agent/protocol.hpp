#pragma once
/// The contract of an algorithm. A protocol is a pure state machine, values in, values out: no socket, clock, thread, file,
/// log or random generator. Both drivers (simulate(), and the agent process over DDS) call the same object.

#include "core/layout.hpp"
#include "core/mailbox.hpp"
#include "core/values.hpp"

#include <memory>
#include <optional>
#include <span>
#include <string_view>

namespace consort {

/// What agent i senses at the beginning of round k.
struct Sense {
  Round k = 0;
  Seconds dt = 1.0;
  std::span<const Neighbour> in_neighbours;  ///< N_i(k) with weights w_ij(k), ascending
  std::size_t out_degree = 0;                ///< how many agents receive from i in round k (mu_i)
  std::optional<Vector> y;                   ///< measurement, absent without a plant
  AgentId self{};                            ///< i, for the text of errors; 0: not said
};

/// What a protocol is told when it starts.
struct Setup {
  AgentId self;
  std::size_t agents = 1;
  Seconds dt = 1.0;
  const Values& initial;
};

/// Documents one parameter or initial value; `validate` and `list` use it.
struct ValueDoc {
  std::string_view name;
  std::string_view shape;     ///< e.g. "scalar", "vector n", "covariance n x n (scalar, diagonal or matrix)"
  std::string_view fallback;  ///< default as text; empty: required
  std::string_view meaning;   ///< one line with unit and symbol
};

/// The type-erased protocol, the only class the drivers know.
class Protocol {
 public:
  virtual ~Protocol() = default;
  [[nodiscard]] virtual const Layout& message_layout() const = 0;
  [[nodiscard]] virtual const Layout& estimate_layout() const = 0;
  /// Writes this round's message; `payload.size() == message_layout().size()`.
  virtual void emit(const Sense&, std::span<double> payload) const = 0;
  /// Moves the state from round k to k + 1.
  virtual void absorb(const Sense&, Inbox) = 0;
  /// Writes the current estimate; `out.size() == estimate_layout().size()`.
  virtual void estimate(std::span<double> out) const = 0;
};

}  // namespace consort
