#include "protocols/control/measured_consensus.hpp"
#include "protocols/control/minimum_energy_consensus.hpp"
#include "protocols/control/static_consensus.hpp"
#include "protocols/registry_entry.hpp"

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
