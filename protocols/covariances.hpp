#pragma once
/// Covariances that leave the range of double. Without process noise a covariance falls geometrically for ever, while estimates depend on
/// ratios of covariances alone. So an agent keeps and sends P with a whole exponent e_c per component: what it means is D P D with
/// D = diag(2^e_c). All e_c are 0 until a variance falls below 2^-400, and every change of unit is a power of two and therefore exact: the
/// numbers are those of a double whose exponent has no limit.

#include "protocols/adapter.hpp"

#include <limits>
#include <span>
#include <vector>

namespace consort {

inline constexpr int kLeastExponent = -400;       ///< of a variance or an information that needs no exponent of its own
inline constexpr double kFarthestExponent = 450;  ///< a deviation 2^450 times another one is infinite beside it

/// On bare numbers, whatever their count: compiled once, not for every protocol and size. Matrices column by column.
namespace detail {

template <class Values>
auto flat(Values& values) {
  return std::span(values.data(), static_cast<std::size_t>(values.size()));
}

/// P becomes D P D with D = diag(2^e_c); 2^e is 0 far below the range.
void scale(std::span<double> P, std::span<const double> e);
/// P in the unit 2^e_c is given the exponents that its size asks for.
void settle_exponents(std::span<double> P, std::span<double> e);
/// `unit` becomes the smaller of itself and the exponents of D P D + noise: where there is noise, what is left of a tiny P beside it needs
/// none.
void lower_to(std::span<double> unit, std::span<const double> e, std::span<const double> noise);
/// P in the unit 2^e_c is brought to the given unit; what is infinite beside it stays finite.
void convert(std::span<double> P, std::span<const double> e, std::span<const double> unit);
/// What one component of x in the unit is, in that of the least sure component: 2^(unit_c - max unit).
std::vector<double> units_of_x(std::span<const double> unit);
void divide(std::span<double> x, std::span<const double> by);
void multiply(std::span<double> x, std::span<const double> by);

inline bool all_zero(std::span<const double> e) {
  return std::all_of(e.begin(), e.end(), [](double value) { return value == 0.0; });
}

}  // namespace detail

/// Gives P, which is in the unit 2^e_c, the exponents that its size asks for.
template <class State>
void settle_exponents(State& s) {
  detail::settle_exponents(detail::flat(s.P), detail::flat(s.e));
}

/// The covariance that the state means (n x n); 0 where double has no number for it.
template <class State>
auto covariance_of(const State& s) {
  auto P = s.P;
  detail::scale(detail::flat(P), detail::flat(s.e));
  return P;
}

/// Spec::round(params, state, sense, inbox) with all covariances in one unit per component, that of the surest, in which theirs are near 1
/// and what is lost of the others does not count. Params has Q, which is added to the agent's own P, and Omega, added to those heard; State
/// and Message have x, P and e.
template <class Spec>
typename Spec::State in_one_unit(const typename Spec::Params& p, const typename Spec::State& s, const Sense& sense,
                                 HeardInbox<typename Spec::Message> inbox) {
  using Message = typename Spec::Message;
  using detail::flat;
  if (detail::all_zero(flat(s.e)) &&
      std::all_of(inbox.begin(), inbox.end(), [](const Heard<Message>& heard) { return detail::all_zero(flat(heard.message.e)); })) {
    typename Spec::State next = Spec::round(p, s, sense, inbox);
    settle_exponents(next);
    return next;
  }
  auto own = s;
  own.e.setConstant(std::numeric_limits<double>::infinity());
  const auto unit = flat(own.e);
  detail::lower_to(unit, flat(s.e), flat(p.Q));
  if constexpr (requires { p.self_term; })
    if (p.self_term) detail::lower_to(unit, flat(s.e), flat(p.Omega));
  for (const auto& heard : inbox) detail::lower_to(unit, flat(heard.message.e), flat(p.Omega));

  // Gains take a component's difference to another component, so differences are in the same units.
  const std::vector<double> of_x = detail::units_of_x(unit), none(of_x.size(), 0.0);
  auto params = p;
  detail::convert(flat(params.Q), none, unit);
  detail::convert(flat(params.Omega), none, unit);
  detail::convert(flat(own.P), flat(s.e), unit);
  detail::divide(flat(own.x), of_x);
  std::vector<Heard<Message>> others(inbox.begin(), inbox.end());
  for (auto& heard : others) {
    detail::convert(flat(heard.message.P), flat(heard.message.e), unit);
    detail::divide(flat(heard.message.x), of_x);
  }
  typename Spec::State next = Spec::round(params, own, sense, HeardInbox<Message>(others));
  detail::multiply(flat(next.x), of_x);
  settle_exponents(next);
  return next;
}

}  // namespace consort
