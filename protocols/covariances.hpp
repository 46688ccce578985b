#pragma once
/// Covariances that leave the range of double. Without process noise a covariance falls geometrically for ever, while estimates depend on
/// ratios of covariances alone. So an agent keeps and sends P with a whole exponent e_c per component: what it means is D P D with
/// D = diag(2^e_c). All e_c are 0 until a variance falls below 2^-400, and every change of unit is a power of two and therefore exact: the
/// numbers are those of a double whose exponent has no limit.

#include "protocols/adapter.hpp"

#include <cmath>
#include <vector>

namespace consort {

inline constexpr int kLeastExponent = -400;       ///< of a variance or an information that needs no exponent of its own
inline constexpr double kFarthestExponent = 450;  ///< a deviation 2^450 times another one is infinite beside it

namespace detail {

/// 2^e, 0 far below the range.
template <class Vec>
Vec powers(const Vec& e) {
  return e.unaryExpr([](double value) { return std::ldexp(1.0, static_cast<int>(std::max(value, -3000.0))); });
}

/// Exponents of D P D + noise: where there is noise, what is left of a tiny P beside it needs none.
template <class Vec, class Mat>
Vec exponents_beside(const Vec& e, const Mat& noise) {
  return (noise.diagonal().array() > 0.0).select(Vec::Zero(e.size()), e);
}

}  // namespace detail

/// Gives P, which is in the unit 2^e_c, the exponents that its size asks for.
template <class State>
void settle_exponents(State& s) {
  const auto wanted = [&s](Eigen::Index c) {
    const double size = std::ilogb(s.P(c, c)) + 2.0 * s.e[c];
    return size < kLeastExponent ? std::floor(0.5 * size) : 0.0;
  };
  bool settled = true;
  for (Eigen::Index c = 0; c < s.e.size(); ++c) settled = settled && s.e[c] == wanted(c);
  if (settled) return;
  auto e = s.e;
  for (Eigen::Index c = 0; c < e.size(); ++c) e[c] = wanted(c);
  const auto scale = detail::powers((s.e - e).eval());
  s.P = (scale.asDiagonal() * s.P * scale.asDiagonal()).eval();
  s.e = e;
}

/// The covariance that the state means (n x n); 0 where double has no number for it.
template <class State>
auto covariance_of(const State& s) {
  const auto scale = detail::powers(s.e);
  return (scale.asDiagonal() * s.P * scale.asDiagonal()).eval();
}

/// Spec::round(params, state, sense, inbox) with all covariances in one unit per component, that of the surest, in which theirs are near 1
/// and what is lost of the others does not count. Params has Q, which is added to the agent's own P, and Omega, added to those heard; State
/// and Message have x, P and e.
template <class Spec>
typename Spec::State in_one_unit(const typename Spec::Params& p, const typename Spec::State& s, const Sense& sense,
                                 HeardInbox<typename Spec::Message> inbox) {
  using Vec = typename Spec::Vec;
  const auto has_none = [](const Vec& e) { return (e.array() == 0.0).all(); };
  bool in_range = has_none(s.e);
  for (const auto& heard : inbox) in_range = in_range && has_none(heard.message.e);
  if (in_range) {
    typename Spec::State next = Spec::round(p, s, sense, inbox);
    settle_exponents(next);
    return next;
  }
  Vec unit = detail::exponents_beside(s.e, p.Q);
  if constexpr (requires { p.self_term; })
    if (p.self_term) unit = unit.cwiseMin(detail::exponents_beside(s.e, p.Omega));
  for (const auto& heard : inbox) unit = unit.cwiseMin(detail::exponents_beside(heard.message.e, p.Omega));

  const auto convert = [&](auto& P, const Vec& e) {
    const Vec scale = detail::powers<Vec>((e - unit).cwiseMin(kFarthestExponent));
    P = (scale.asDiagonal() * P * scale.asDiagonal()).eval();
  };
  // Gains take a component's difference to another component, so differences are in the same units.
  const Vec of_x = detail::powers<Vec>((unit.array() - unit.maxCoeff()).max(-kFarthestExponent).matrix());
  const Vec none = Vec::Zero(s.e.size());
  auto params = p;
  convert(params.Q, none);
  convert(params.Omega, none);
  auto own = s;
  convert(own.P, s.e);
  own.x = s.x.cwiseQuotient(of_x);
  own.e = unit;
  std::vector<Heard<typename Spec::Message>> others(inbox.begin(), inbox.end());
  for (auto& heard : others) {
    convert(heard.message.P, Vec(heard.message.e));
    heard.message.x = heard.message.x.cwiseQuotient(of_x).eval();
  }
  typename Spec::State next = Spec::round(params, own, sense, HeardInbox<typename Spec::Message>(others));
  next.x = next.x.cwiseProduct(of_x).eval();
  settle_exponents(next);
  return next;
}

}  // namespace consort
