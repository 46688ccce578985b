#include "agent/protocols/measured_consensus.hpp"
#include "agent/protocols/minimum_energy_consensus.hpp"
#include "agent/protocols/static_consensus.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> control_protocols() {
  static const std::array table{
      entry<StaticConsensus>(),
      entry<MinimumEnergyConsensus>(),
      entry<MeasuredConsensus>(),
  };
  return table;
}

}  // namespace consort
