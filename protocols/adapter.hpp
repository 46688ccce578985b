#pragma once
/// From a protocol written as pure functions over typed values (ProtocolSpec) to the class the drivers know (Protocol).

#include "core/errors.hpp"
#include "core/math/spd.hpp"
#include "core/nearest.hpp"
#include "protocols/spec.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace consort {

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
