#pragma once
/// The table of plant models: one visible line each in registry.cpp.

#include "core/value_doc.hpp"
#include "models/model.hpp"

#include <memory>
#include <string_view>

namespace consort {

struct PlantEntry {
  std::string_view name;
  std::string_view summary;  ///< one line, with the equation
  std::span<const ValueDoc> parameters;
  std::span<const ValueDoc> initial;
  std::span<const ValueDoc> couplings;  ///< what one agent's part may do to another's; empty: parts are not coupled
  bool shared = false;                  ///< one plant that every agent observes
  /// Throws ConfigError (naming parameter or initial value, what was found, what is allowed).
  std::unique_ptr<PlantModel> (*make)(const PlantSetup& setup);
};

std::span<const PlantEntry> plant_table();
/// Throws ConfigError naming the nearest match.
const PlantEntry& find_plant(std::string_view name);
/// The names of those that are shared: "one, another".
std::string shared_plants();

}  // namespace consort
