#include "protocols/registry.hpp"

#include "core/counted.hpp"
#include "core/nearest.hpp"

#include <vector>

namespace consort {

std::span<const ProtocolEntry> protocol_table() {
  static const std::vector<ProtocolEntry> table = [] {
    std::vector<ProtocolEntry> all;
    for (const auto family : {consensus_protocols(), control_protocols(), adaptive_protocols(), filters_protocols(), everybody_protocols(),
                              sensor_network_protocols()})
      all.insert(all.end(), family.begin(), family.end());
    return all;
  }();
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
    throw ConfigError(who + ": it gives " + counted(controls, "control") + "; the plant takes " + std::to_string(*plant_controls) +
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
