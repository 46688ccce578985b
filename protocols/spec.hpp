#pragma once
/// What a protocol is that is written as pure functions over typed values (ProtocolSpec), and what it may say of itself beyond them.

#include "protocols/protocol.hpp"

#include <array>
#include <concepts>
#include <string_view>
#include <tuple>
#include <type_traits>
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

}  // namespace consort
