#include "protocols/everybody/acyclic_sensing.hpp"
#include "protocols/everybody/cooperative_localization.hpp"
#include "protocols/everybody/distributed_observer.hpp"
#include "protocols/registry_entry.hpp"

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
