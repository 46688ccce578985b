#include "models/registry.hpp"

#include "core/nearest.hpp"
#include "models/beam.hpp"
#include "models/integrator.hpp"
#include "models/linear.hpp"
#include "models/shared_linear.hpp"
#include "models/sine_drift.hpp"

namespace consort {
namespace {

template <class M>
PlantEntry entry() {
  std::span<const ValueDoc> couplings;
  if constexpr (requires { M::couplings; }) couplings = M::couplings;
  bool shared = false;
  if constexpr (requires { M::shared; }) shared = M::shared;
  return {M::name, M::summary, M::parameters, M::initial, couplings, shared, &M::make};
}

}  // namespace

std::span<const PlantEntry> plant_table() {
  static const std::array table{
      entry<Integrator>(), entry<Linear>(), entry<SharedLinear>(), entry<ClampedBeam>(), entry<SineDrift>(),
  };
  return table;
}

const PlantEntry& find_plant(std::string_view name) {
  std::vector<std::string_view> known;
  for (const PlantEntry& entry : plant_table()) {
    if (entry.name == name) return entry;
    known.push_back(entry.name);
  }
  throw ConfigError(unknown_word("plant model", name, known));
}

std::string shared_plants() {
  std::string names;
  for (const PlantEntry& entry : plant_table())
    if (entry.shared) names += (names.empty() ? "" : ", ") + std::string(entry.name);
  return names;
}

}  // namespace consort
