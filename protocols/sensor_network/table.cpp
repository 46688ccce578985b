#include "protocols/registry_entry.hpp"
#include "protocols/sensor_network/sensor_network_observer.hpp"

namespace consort {

std::span<const ProtocolEntry> sensor_network_protocols() {
  static const std::array table{
      entry<SensorNetworkObserver>(),
  };
  return table;
}

}  // namespace consort
