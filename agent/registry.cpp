#include "agent/registry.hpp"

#include "agent/protocol_adapter.hpp"
#include "agent/protocol_sensing.hpp"
#include "agent/protocols/acyclic_sensing.hpp"
#include "agent/protocols/adaptive_consensus.hpp"
#include "agent/protocols/continuous_kalman_consensus.hpp"
#include "agent/protocols/cooperative_localization.hpp"
#include "agent/protocols/das_neural_consensus.hpp"
#include "agent/protocols/distributed_observer.hpp"
#include "agent/protocols/dkf_iterative.hpp"
#include "agent/protocols/dkf_kim.hpp"
#include "agent/protocols/dkf_olfati_saber.hpp"
#include "agent/protocols/dlo_kim.hpp"
#include "agent/protocols/dlo_zhang.hpp"
#include "agent/protocols/kalman_bucy.hpp"
#include "agent/protocols/kalman_consensus.hpp"
#include "agent/protocols/li_agent_consensus.hpp"
#include "agent/protocols/li_edge_consensus.hpp"
#include "agent/protocols/local_voting.hpp"
#include "agent/protocols/measured_consensus.hpp"
#include "agent/protocols/minimum_energy_consensus.hpp"
#include "agent/protocols/robust_information_consensus.hpp"
#include "agent/protocols/sensor_network_observer.hpp"
#include "agent/protocols/static_consensus.hpp"
#include "agent/protocols/su_consensus.hpp"
#include "agent/protocols/unbiased_information_consensus.hpp"
#include "agent/protocols/unbiased_kalman_consensus.hpp"
#include "agent/protocols/yu_consensus.hpp"
#include "core/nearest.hpp"

namespace consort {
namespace {

/// That of the initial x or, without one, that of what the agent measures of itself.
Eigen::Index dimension_of(const Setup& setup, std::string_view protocol) {
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
  if constexpr (requires { Spec::needs_plant; }) needs_plant = Spec::needs_plant;
  return {Spec::name,    Spec::summary, Spec::source,     Spec::assumptions, Spec::parameters,
          Spec::initial, announces,     truth_of<Spec>(), needs_plant,       make};
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

}  // namespace

std::span<const ProtocolEntry> protocol_table() {
  static const std::array table{
      entry<LocalVoting>(),
      entry<KalmanConsensus>(),
      entry<ContinuousKalmanConsensus>(),
      entry<UnbiasedKalmanConsensus>(),
      entry<UnbiasedInformationConsensus>(),
      entry<RobustInformationConsensus>(),
      entry<StaticConsensus>(),
      entry<MinimumEnergyConsensus>(),
      entry<MeasuredConsensus>(),
      entry<AdaptiveConsensus>(),
      entry<SuConsensus>(),
      entry<YuConsensus>(),
      entry<LiEdgeConsensus>(),
      entry<LiAgentConsensus>(),
      entry<DasNeuralConsensus>(),
      entry<KalmanBucy>(),
      entry<DkfOlfatiSaber>(),
      entry<DkfIterative>(),
      entry<DkfKim>(),
      entry<DloKim>(),
      entry<DloZhang>(),
      entry<DistributedObserver>(),
      entry<AcyclicSensingGraph>(),
      entry<CooperativeLocalization>(),
      entry<SensorNetworkObserver>(),
  };
  return table;
}

std::unique_ptr<Protocol> make_protocol(const ProtocolEntry& entry, const Values& parameters, const Setup& setup,
                                        std::optional<std::size_t> plant_controls) {
  const std::string who = "protocol " + std::string(entry.name);
  if (entry.needs_plant && !plant_controls)
    throw ConfigError(who + ": it measures and steers a plant; the experiment needs a 'plant' section");
  auto protocol = entry.make(parameters, setup);
  const std::size_t controls = protocol->control_size();
  if (plant_controls && controls > 0 && controls != *plant_controls)
    throw ConfigError(who + ": it gives " + std::to_string(controls) + " controls; the plant takes " + std::to_string(*plant_controls) +
                      " from agent " + std::to_string(setup.self.value));
  return protocol;
}

const ProtocolEntry& find_protocol(std::string_view name) {
  std::vector<std::string_view> known;
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.name == name) return entry;
    known.push_back(entry.name);
  }
  throw ConfigError(unknown_word("protocol", name, known));
}

}  // namespace consort
