#pragma once
/// Experiments with a plant, made without a file.

#include "core/experiment.hpp"

#include <memory>
#include <utility>

namespace consort {

inline PerAgent same(Matrix value) { return {PerAgent::Same{std::move(value)}}; }
inline PerAgent same(double value) { return same(Matrix::Constant(1, 1, value)); }
inline PerAgent each(const std::vector<double>& values) {
  PerAgent::List list;
  for (const double value : values) list.values.push_back(Matrix::Constant(1, 1, value));
  return {list};
}
inline TopologySpec for_ever(Graph graph) { return FixedSchedule{{{std::make_shared<const Graph>(std::move(graph)), 1}}, false}; }

/// n integrators of the given order and dimension 1, started at `position` with velocity 0.
inline PlantSpec integrators(int order, const std::vector<double>& position) {
  PlantSpec plant;
  plant.model = "integrator";
  plant.parameters.set("order", order);
  plant.initial = {{"position", each(position)}};
  return plant;
}

}  // namespace consort
