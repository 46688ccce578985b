#include "agent/protocols/acyclic_sensing.hpp"
#include "agent/protocols/cooperative_localization.hpp"
#include "agent/protocols/distributed_observer.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> everybody_protocols() {
  static const std::array table{
      entry<DistributedObserver>(),
      entry<AcyclicSensingGraph>(),
      entry<CooperativeLocalization>(),
  };
  return table;
}

}  // namespace consort
