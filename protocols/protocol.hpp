#pragma once
/// The contract of an algorithm. A protocol is a pure state machine, values in, values out: no socket, clock, thread, file,
/// log or random generator. Both drivers (simulate(), and the agent process over DDS) call the same object.

#include "core/layout.hpp"
#include "core/network/mailbox.hpp"
#include "core/trace.hpp"
#include "core/value_doc.hpp"
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
  std::span<const double> y;                 ///< y_i(k), what the plant lets i measure; empty without a plant
  AgentId self{};                            ///< i, for the text of errors; 0: not said
  std::span<const Values* const> told = {};  ///< by agent: what it announced; null where nothing has been heard

  /// What agent j says of itself in its layout message. Null as long as it takes no part, if it announces nothing, or if no path leads
  /// from it to i.
  [[nodiscard]] const Values* announced(AgentId j) const { return index_of(j) < told.size() ? told[index_of(j)] : nullptr; }
};

inline const Values& no_values() {
  static const Values none;
  return none;
}

/// What a protocol is told when it starts.
struct Setup {
  AgentId self;
  std::size_t agents = 1;  ///< the agreed maximum number of agents
  Seconds dt = 1.0;
  const Values& initial;
  const Values& model = no_values();  ///< what the agent knows of its own dynamics (A, B, C, ...); empty without a plant
  std::size_t measurement_size = 0;   ///< of y_i; 0 without a plant
  std::size_t largest_state = 0;      ///< largest n_j of any agent's part of the plant: agreed, as the number of agents is
  std::size_t largest_control = 0;    ///< length of the longest u of any agent that the plant takes: agreed too; 0 without a plant
};

/// The type-erased protocol, the only class the drivers know.
class Protocol {
 public:
  virtual ~Protocol() = default;
  [[nodiscard]] virtual const Layout& message_layout() const = 0;
  [[nodiscard]] virtual const Layout& estimate_layout() const = 0;
  /// What else of its state is worth recording beside the estimate.
  [[nodiscard]] virtual const Layout& recorded_layout() const = 0;
  /// What the agent says of itself to everybody, once, in its layout message; empty: nothing.
  [[nodiscard]] virtual const Values& announcement() const = 0;
  /// Writes this round's message; `payload.size() == message_layout().size()`.
  virtual void emit(const Sense&, std::span<double> payload) const = 0;
  /// Moves the state from round k to k + 1.
  virtual void absorb(const Sense&, Inbox) = 0;
  /// Writes the current estimate; `out.size() == estimate_layout().size()`.
  virtual void estimate(std::span<double> out) const = 0;
  /// Writes the first fields of what is worth recording, as far as `out` reaches; it ends where a field does. What is not finite is
  /// kAbsent.
  virtual void recorded(std::span<double> out) const = 0;
  /// Length of u_i; 0: this protocol steers nothing.
  [[nodiscard]] virtual std::size_t control_size() const = 0;
  /// Writes u_i of the round that was absorbed last; `out.size() == control_size()`.
  virtual void control(std::span<double> out) const = 0;
};

/// So many numbers of one agent are recorded beside its estimate, unless the experiment says otherwise.
inline constexpr std::size_t kRecordedNumbers = 16;

/// Of all that is worth recording, what is recorded: all or nothing where `wanted` says so, else the first fields that fit.
inline Layout recorded_part(const Layout& all, std::optional<bool> wanted) {
  if (wanted) return *wanted ? all : Layout{};
  Layout part;
  for (const Field& field : all.fields) {
    if (part.size() + field.size() > kRecordedNumbers) break;
    part.fields.push_back(field);
  }
  return part;
}

}  // namespace consort
