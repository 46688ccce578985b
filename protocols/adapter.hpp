#pragma once
/// From a protocol written as pure functions over typed values (ProtocolSpec) to the class the drivers know (Protocol).

#include "core/errors.hpp"
#include "core/math/spd.hpp"
#include "core/nearest.hpp"
#include "protocols/protocol.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace consort {

/// A vector in a message that is not copied: on its way out it stays in the measurement or the state it is taken from, on its way in
/// it stays in what arrived. Good for the call it is given to.
class Numbers {
 public:
  Numbers() = default;
  // Not explicit: a message names what it sends.
  Numbers(std::span<const double> numbers) : numbers_(numbers) {}
  Numbers(const Eigen::Map<const Vector>& vector) : numbers_(vector.data(), static_cast<std::size_t>(vector.size())) {}
  [[nodiscard]] const double* data() const { return numbers_.data(); }
  [[nodiscard]] std::size_t size() const { return numbers_.size(); }
  /// n x 1.
  [[nodiscard]] Eigen::Map<const Vector> vector() const { return {data(), static_cast<Eigen::Index>(size())}; }

 private:
  std::span<const double> numbers_;
};

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

/// How a protocol makes its parameters: from the values and the dimension of the initial x, or, where it needs to know more (its own
/// dynamics A, B, C, what it measures), from the values and the set-up.
template <class P>
concept MakesParamsFromDimension = requires(const Values& values, Eigen::Index n) {
  { P::params(values, n) } -> std::same_as<typename P::Params>;
};
template <class P>
concept MakesParamsFromSetup = requires(const Values& values, const Setup& setup) {
  { P::params(values, setup) } -> std::same_as<typename P::Params>;
};

/// A protocol that steers: u_i of the round that led to state s (m x 1).
template <class P>
concept Steers = requires(const typename P::Params& p, const typename P::State& s) {
  Vector(P::control(p, s));
};

/// A protocol whose agents tell everybody something about themselves before they take part: their model, for example. It must be the same
/// whenever it is asked.
template <class P>
concept Announces = requires(const typename P::Params& p, const Setup& setup) {
  { P::announcement(p, setup) } -> std::same_as<Values>;
};

/// What the estimate is an estimate of; most protocols agree on something that no plant knows.
template <class P>
constexpr Truth truth_of() {
  if constexpr (requires { P::truth; })
    return P::truth;
  else
    return Truth::none;
}

/// A protocol whose estimate is more than one vector x says what the numbers are, in the order of `estimate`.
template <class P>
concept NamesItsEstimate = requires(const typename P::State& s) {
  { P::estimate_fields(s) } -> std::same_as<std::vector<Field>>;
};

/// What u_i is in a record.
inline constexpr ValueDoc kRecordedControl{"u", "vector m", "", "u_i of the round before (unit of the plant's input); 0 at the start"};

/// A protocol says what else of its state is worth recording: numbers and matrices of fixed shapes, as a tuple, small ones first, and their
/// names in the same order. The control of one that steers is recorded anyway, before them.
template <class P>
concept Records = requires(const typename P::Params& p, const typename P::State& s) {
  P::recorded(p, s);
  std::span<const ValueDoc>(P::recorded_values);
  requires std::tuple_size_v<decltype(P::recorded(p, s))>
  == std::size(P::recorded_values);
};

/// What a record of the protocol holds beside its estimate.
template <class P>
std::span<const ValueDoc> recorded_values_of() {
  static const std::vector<ValueDoc> docs = [] {
    std::vector<ValueDoc> all;
    if constexpr (Steers<P>) all.push_back(kRecordedControl);
    if constexpr (Records<P>) all.insert(all.end(), P::recorded_values.begin(), P::recorded_values.end());
    return all;
  }();
  return docs;
}

/// What the numbers of its estimate are, if it says more than that they are x.
template <class P>
std::span<const ValueDoc> estimate_values_of() {
  static constexpr std::array kX{ValueDoc{"x", "vector n", "", "estimate x_i"}};
  if constexpr (requires { std::span<const ValueDoc>(P::estimate_values); })
    return P::estimate_values;
  else
    return kX;
}

/// A state that is costly to hand on (windows, gains, vectors of any length) may be moved from round k to k + 1 where it is: transition
/// then takes State& and returns nothing. Still a pure function: what comes out depends on what goes in alone.
template <class P>
concept MovesItsState = requires(const typename P::Params& p, typename P::State& s, const Sense& sense,
                                 HeardInbox<typename P::Message> inbox) {
  { P::transition(p, s, sense, inbox) } -> std::same_as<void>;
};
template <class P>
concept ReturnsItsState = requires(const typename P::Params& p, const typename P::State& s, const Sense& sense,
                                   HeardInbox<typename P::Message> inbox) {
  { P::transition(p, s, sense, inbox) } -> std::same_as<typename P::State>;
};

/// A whole algorithm: a few pure static functions and what there is to say about it.
template <class P>
concept ProtocolSpec = MessageSpec<typename P::Message> && std::copyable<typename P::State> && std::copyable<typename P::Params> &&
    requires(const typename P::Params& p, const typename P::State& s, const Setup& setup, const Sense& sense,
             HeardInbox<typename P::Message> inbox) {
  { P::name } -> std::convertible_to<std::string_view>;
  { P::summary } -> std::convertible_to<std::string_view>;
  { P::source } -> std::convertible_to<std::string_view>;
  { P::assumptions } -> std::convertible_to<std::string_view>;
  std::span<const ValueDoc>(P::parameters);
  std::span<const ValueDoc>(P::initial);
  requires MakesParamsFromDimension<P> || MakesParamsFromSetup<P>;
  { P::init(p, setup) } -> std::same_as<typename P::State>;
  { P::message(p, s, sense) } -> std::same_as<typename P::Message>;
  requires MovesItsState<P> || ReturnsItsState<P>;
  Vector(P::estimate(s));
};

namespace detail {

inline void put(double*& to, double value) { *to++ = value; }
template <class Derived>
void put(double*& to, const Eigen::MatrixBase<Derived>& value) {
  Eigen::Map<typename Derived::PlainObject>(to, value.rows(), value.cols()) = value;
  to += value.size();
}
inline void put(double*& to, const Numbers& value) { put(to, value.vector()); }
inline void get(const double*& from, double& value) { value = *from++; }
template <class Derived>
void get(const double*& from, Eigen::MatrixBase<Derived>& value) {  // `value` has its shape already
  value = Eigen::Map<const typename Derived::PlainObject>(from, value.rows(), value.cols());
  from += value.size();
}
inline void get(const double*& from, Numbers& value) {  // `value` has its length already
  value = std::span(from, value.size());
  from += value.size();
}
inline Field field(std::string_view name, double) { return {std::string(name), 1, 1}; }
template <class Derived>
Field field(std::string_view name, const Eigen::MatrixBase<Derived>& value) {
  return {std::string(name), static_cast<std::size_t>(value.rows()), static_cast<std::size_t>(value.cols())};
}
inline Field field(std::string_view name, const Numbers& value) { return {std::string(name), value.size(), 1}; }

/// False as soon as one number is infinite or not a number. Nothing of an absent agent counts (`may_lack`).
template <bool may_lack, class Derived>
bool all_finite(const Eigen::MatrixBase<Derived>& value) {
  if constexpr (may_lack) {
    for (Eigen::Index i = 0; i < value.size(); ++i)
      if (!std::isfinite(value.derived().coeff(i)) && !is_absent(value.derived().coeff(i))) return false;
    return true;
  }
  double residue = 0.0;
  for (Eigen::Index i = 0; i < value.size(); ++i) residue += 0.0 * value.derived().coeff(i);
  return residue == 0.0;
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
        params_((require_known("protocol " + std::string(P::name), "parameter", parameters, P::parameters), params_of(parameters, setup))),
        state_(P::init(params_, setup)),
        prototype_(first_message(setup)),
        message_layout_(detail::layout_of(prototype_)) {
    if constexpr (NamesItsEstimate<P>)
      estimate_layout_.fields = P::estimate_fields(state_);
    else
      estimate_layout_.fields = {{"x", static_cast<std::size_t>(P::estimate(state_).size()), 1}};
    if constexpr (Announces<P>) announcement_ = P::announcement(params_, setup);
    if constexpr (Steers<P>) control_size_ = static_cast<std::size_t>(P::control(params_, state_).size());
    if constexpr (Steers<P>) recorded_control_ = std::max(control_size_, setup.largest_control);
    if (recorded_control_ > 0) recorded_layout_.fields.push_back({std::string(kRecordedControl.name), recorded_control_, 1});
    if constexpr (Records<P>) {
      std::apply(
          [&](const auto&... value) {
            std::size_t i = 0;
            (recorded_layout_.fields.push_back(detail::field(P::recorded_values[i++].name, value)), ...);
          },
          P::recorded(params_, state_));
    }
  }

  [[nodiscard]] const Layout& message_layout() const override { return message_layout_; }
  [[nodiscard]] const Layout& estimate_layout() const override { return estimate_layout_; }
  [[nodiscard]] const Layout& recorded_layout() const override { return recorded_layout_; }

  [[nodiscard]] const Values& announcement() const override { return announcement_; }

  /// Throws RunError naming agent, round and protocol when what it sends is not finite.
  void emit(const Sense& sense, std::span<double> payload) const override {
    if (payload.size() != message_layout_.size()) throw std::logic_error("a message is as long as its layout says");
    const Message message = P::message(params_, state_, sense);
    double* to = payload.data();
    std::apply([&](const auto&... value) { (detail::put(to, value), ...); }, Message::fields(message));
    const Eigen::Map<const Vector> sent(payload.data(), static_cast<Eigen::Index>(payload.size()));
    if (!detail::all_finite<truth_of<P>() == Truth::everybody>(sent)) refuse(sense.k, "what it sends");
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
    const HeardInbox<Message> given(heard_.data(), inbox.size());
    if constexpr (MovesItsState<P>)
      P::transition(params_, state_, sense, given);
    else
      state_ = P::transition(params_, std::move(state_), sense, given);
    if (!detail::all_finite<truth_of<P>() == Truth::everybody>(P::estimate(state_))) refuse(sense.k, "the estimate");
    if constexpr (Steers<P>) {
      if (!detail::all_finite<false>(P::control(params_, state_))) refuse(sense.k, "the control");
    }
  }

  void estimate(std::span<double> out) const override {
    double* to = out.data();
    detail::put(to, P::estimate(state_));
  }

  void recorded(std::span<double> out) const override {
    double* to = out.data();
    const double* const end = to + out.size();
    if (recorded_control_ > 0 && to < end) {
      control({to, control_size_});
      std::fill_n(to + control_size_, recorded_control_ - control_size_, kAbsent);
      to += recorded_control_;
    }
    if constexpr (Records<P>) {
      const auto add = [&](const auto& value) {
        if (to < end) detail::put(to, value);
      };
      std::apply([&](const auto&... value) { (add(value), ...); }, P::recorded(params_, state_));
    }
    check(to == end, "a record ends where a field does");
    for (double& value : out)
      if (!std::isfinite(value)) value = kAbsent;
  }

  [[nodiscard]] std::size_t control_size() const override { return control_size_; }
  void control([[maybe_unused]] std::span<double> out) const override {
    if constexpr (Steers<P>) {
      double* to = out.data();
      detail::put(to, P::control(params_, state_));
    }
  }

 private:
  static typename P::Params params_of(const Values& parameters, const Setup& setup) {
    if constexpr (MakesParamsFromSetup<P>)
      return P::params(parameters, setup);
    else
      return P::params(parameters, setup.initial.vector("x").size());
  }
  /// Has the shapes of every message; what the agent will measure is still zero.
  [[nodiscard]] Message first_message(const Setup& setup) const {
    const std::vector<double> y(setup.measurement_size, 0.0);
    return P::message(params_, state_, Sense{.in_neighbours = {}, .y = y, .self = setup.self});
  }
  [[noreturn]] void refuse(Round k, const char* what) const {
    throw RunError(std::string(P::name) + ": agent " + std::to_string(self_.value) + ", round " + std::to_string(k) + ": " + what +
                   " is no longer finite");
  }

  AgentId self_;
  typename P::Params params_;
  typename P::State state_;
  Message prototype_;  // has the shapes of every message; its Numbers have their lengths only
  Layout message_layout_, estimate_layout_, recorded_layout_;
  Values announcement_;
  std::size_t control_size_ = 0, recorded_control_ = 0;  // all agents record as much: what one of them lacks is absent
  std::vector<Heard<Message>> heard_;                    // grows to the largest inbox seen, then is reused
};

}  // namespace consort
