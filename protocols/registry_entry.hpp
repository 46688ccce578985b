#pragma once
/// How a protocol becomes an entry of the table. Included by the families' tables only: each compiles its own protocols, once.

#include "protocols/adapter.hpp"
#include "protocols/registry.hpp"
#include "protocols/sensing.hpp"

#include <array>

namespace consort {

/// That of the initial x or, without one, that of what the agent measures of itself.
inline Eigen::Index dimension_of(const Setup& setup, std::string_view protocol) {
  if (setup.initial.has("x")) return setup.initial.vector("x").size();
  if (setup.measurement_size > 0) return Sensing(setup, protocol).output_size();
  throw ConfigError("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value) + " has no initial x");
}

/// The instantiation for the dimension of x: sizes known to the compiler where they are common.
template <template <int> class P>
std::unique_ptr<Protocol> make(const Values& parameters, const Setup& setup) {
  switch (dimension_of(setup, P<1>::name)) {
    case 1:
      return std::make_unique<ProtocolOf<P<1>>>(parameters, setup);
    case 2:
      return std::make_unique<ProtocolOf<P<2>>>(parameters, setup);
    case 3:
      return std::make_unique<ProtocolOf<P<3>>>(parameters, setup);
    case 4:
      return std::make_unique<ProtocolOf<P<4>>>(parameters, setup);
    case 6:
      return std::make_unique<ProtocolOf<P<6>>>(parameters, setup);
    case 8:
      return std::make_unique<ProtocolOf<P<8>>>(parameters, setup);
    default:
      return std::make_unique<ProtocolOf<P<Eigen::Dynamic>>>(parameters, setup);
  }
}

template <class Spec>
ProtocolEntry described(decltype(ProtocolEntry::make) make, bool announces) {
  bool needs_plant = false;
  std::span<const MetricEntry> metrics;
  decltype(ProtocolEntry::examine) examine = nullptr;
  if constexpr (requires { Spec::needs_plant; }) needs_plant = Spec::needs_plant;
  if constexpr (requires { Spec::metrics; }) metrics = Spec::metrics;
  if constexpr (requires { Spec::examine; }) examine = Spec::examine;
  return {Spec::name,
          Spec::summary,
          Spec::source,
          Spec::assumptions,
          Spec::parameters,
          Spec::initial,
          estimate_values_of<Spec>(),
          recorded_values_of<Spec>(),
          announces,
          truth_of<Spec>(),
          Steers<Spec>,
          needs_plant,
          metrics,
          examine,
          make};
}

template <template <int> class P>
ProtocolEntry entry() {
  return described<P<Eigen::Dynamic>>(&make<P>, Announces<P<Eigen::Dynamic>>);
}

/// A protocol whose sizes follow from the plant.
template <class P>
ProtocolEntry entry() {
  return described<P>([](const Values& parameters,
                         const Setup& setup) -> std::unique_ptr<Protocol> { return std::make_unique<ProtocolOf<P>>(parameters, setup); },
                      Announces<P>);
}

}  // namespace consort
