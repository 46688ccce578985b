#pragma once
/// From a protocol written as pure functions over typed values (ProtocolSpec) to the class the drivers know (Protocol).

#include "agent/protocol.hpp"
#include "core/errors.hpp"
#include "core/nearest.hpp"
#include "core/spd.hpp"

#include <algorithm>
#include <array>
#include <concepts>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace consort {

/// A received message with its numbers in their places again.
template <class Message>
struct Heard {
  AgentId from;
  Round sent = 0;       ///< round in which it was emitted
  double weight = 1.0;  ///< w_ij of the edge it crossed
  Message message;
};
/// Ascending by sender. A message the link lost is absent.
template <class Message>
using HeardInbox = std::span<const Heard<Message>>;

/// A message names its fields, gives them as a tuple of numbers and matrices, and says which one link noise disturbs.
template <class M>
concept MessageSpec = std::default_initializable<M> && std::copyable<M> && requires(M& message, const M& constant) {
  M::fields(message);
  M::fields(constant);
  { M::noisy_field } -> std::convertible_to<std::string_view>;
  requires std::tuple_size_v<decltype(M::fields(message))>
  == std::tuple_size_v<std::remove_cvref_t<decltype(M::field_names)>>;
};

/// A whole algorithm: five pure static functions and what there is to say about it.
template <class P>
concept ProtocolSpec = MessageSpec<typename P::Message> && std::copyable<typename P::State> && std::copyable<typename P::Params> &&
    requires(const typename P::Params& p, const typename P::State& s, const Values& values, const Setup& setup, const Sense& sense,
             HeardInbox<typename P::Message> inbox, Eigen::Index n) {
  { P::name } -> std::convertible_to<std::string_view>;
  { P::summary } -> std::convertible_to<std::string_view>;
  { P::source } -> std::convertible_to<std::string_view>;
  { P::assumptions } -> std::convertible_to<std::string_view>;
  std::span<const ValueDoc>(P::parameters);
  std::span<const ValueDoc>(P::initial);
  { P::params(values, n) } -> std::same_as<typename P::Params>;
  { P::init(p, setup) } -> std::same_as<typename P::State>;
  { P::message(p, s, sense) } -> std::same_as<typename P::Message>;
  { P::transition(p, s, sense, inbox) } -> std::same_as<typename P::State>;
  Vector(P::estimate(s));
};

namespace detail {

inline void put(double*& to, double value) { *to++ = value; }
template <class Derived>
void put(double*& to, const Eigen::MatrixBase<Derived>& value) {
  Eigen::Map<typename Derived::PlainObject>(to, value.rows(), value.cols()) = value;
  to += value.size();
}
inline void get(const double*& from, double& value) { value = *from++; }
template <class Derived>
void get(const double*& from, Eigen::MatrixBase<Derived>& value) {  // `value` has its shape already
  value = Eigen::Map<const typename Derived::PlainObject>(from, value.rows(), value.cols());
  from += value.size();
}
inline Field field(std::string_view name, double) { return {std::string(name), 1, 1}; }
template <class Derived>
Field field(std::string_view name, const Eigen::MatrixBase<Derived>& value) {
  return {std::string(name), static_cast<std::size_t>(value.rows()), static_cast<std::size_t>(value.cols())};
}

/// Names and shapes of a message, taken from one that has its shapes.
template <MessageSpec M>
Layout layout_of(const M& message) {
  Layout layout;
  std::apply(
      [&](const auto&... value) {
        std::size_t i = 0;
        (layout.fields.push_back(field(M::field_names[i++], value)), ...);
      },
      M::fields(message));
  for (const Field& field : layout.fields) {
    if (field.name == M::noisy_field) {
      layout.noise_size = field.size();
      return layout;
    }
    layout.noise_offset += field.size();
  }
  check(M::noisy_field.empty(), "the field that link noise disturbs is one of the message's fields");
  layout.noise_offset = 0;
  return layout;
}

inline void require_known(std::string_view protocol, const Values& values, std::span<const ValueDoc> docs) {
  std::vector<std::string_view> known;
  for (const ValueDoc& doc : docs) known.push_back(doc.name);
  for (const Values::Entry& entry : values.entries())
    if (std::find(known.begin(), known.end(), entry.name) == known.end())
      throw ConfigError("protocol " + std::string(protocol) + ": " + unknown_word("parameter", entry.name, known));
}

}  // namespace detail

/// Holds parameters and state of one agent and translates between typed messages and bare doubles (fields one after the other,
/// each column-major). In steady state a message costs no heap allocation.
template <ProtocolSpec P>
class ProtocolOf final : public Protocol {
  using Message = typename P::Message;

 public:
  /// Throws ConfigError on an unknown parameter and whatever `P::params` and `P::init` refuse.
  ProtocolOf(const Values& parameters, const Setup& setup)
      : self_(setup.self),
        params_((detail::require_known(P::name, parameters, P::parameters), P::params(parameters, dimension_of(setup)))),
        state_(P::init(params_, setup)),
        prototype_(P::message(params_, state_, Sense{})),
        message_layout_(detail::layout_of(prototype_)) {
    estimate_layout_.fields = {{"x", static_cast<std::size_t>(P::estimate(state_).size()), 1}};
  }

  [[nodiscard]] const Layout& message_layout() const override { return message_layout_; }
  [[nodiscard]] const Layout& estimate_layout() const override { return estimate_layout_; }

  void emit(const Sense& sense, std::span<double> payload) const override {
    const Message message = P::message(params_, state_, sense);
    double* to = payload.data();
    std::apply([&](const auto&... value) { (detail::put(to, value), ...); }, Message::fields(message));
  }

  /// Throws RunError naming agent, round and protocol when the estimate stops being finite.
  void absorb(const Sense& sense, Inbox inbox) override {
    if (heard_.size() < inbox.size()) heard_.resize(inbox.size(), {AgentId{}, 0, 1.0, prototype_});
    for (std::size_t i = 0; i < inbox.size(); ++i) {
      Heard<Message>& heard = heard_[i];
      heard.from = inbox[i].from;
      heard.sent = inbox[i].sent;
      heard.weight = inbox[i].weight;
      const double* from = inbox[i].payload.data();
      std::apply([&](auto&... value) { (detail::get(from, value), ...); }, Message::fields(heard.message));
    }
    state_ = P::transition(params_, state_, sense, HeardInbox<Message>(heard_.data(), inbox.size()));
    if (!P::estimate(state_).allFinite()) refuse_estimate(sense.k);
  }

  void estimate(std::span<double> out) const override {
    Eigen::Map<Vector>(out.data(), static_cast<Eigen::Index>(out.size())) = P::estimate(state_);
  }

 private:
  static Eigen::Index dimension_of(const Setup& setup) { return setup.initial.vector("x").size(); }
  [[noreturn]] void refuse_estimate(Round k) const {
    throw RunError(std::string(P::name) + ": agent " + std::to_string(self_.value) + ", round " + std::to_string(k) +
                   ": the estimate is no longer finite");
  }

  AgentId self_;
  typename P::Params params_;
  typename P::State state_;
  Message prototype_;  // has the shapes of every message
  Layout message_layout_, estimate_layout_;
  std::vector<Heard<Message>> heard_;  // grows to the largest inbox seen, then is reused
};

}  // namespace consort
