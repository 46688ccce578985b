#include "agent/protocols/sensor_network_observer.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> sensor_network_protocols() {
  static const std::array table{
      entry<SensorNetworkObserver>(),
  };
  return table;
}

}  // namespace consort
