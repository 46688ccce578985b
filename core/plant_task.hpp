#pragma once
/// What it takes to be the physics of one run: the plant's part of the experiment with every number in its place.

#include "core/experiment.hpp"

#include <string>
#include <vector>

namespace consort {

/// A disturbance as one agent meets it.
struct Signal {
  enum class Kind : std::uint8_t { gaussian, intensity, uniform, sinusoid, constant };
  Disturbance::On on = Disturbance::On::measurement;
  Kind kind = Kind::constant;
  std::uint32_t number = 0;  ///< of the disturbance in the experiment: keys its draws
  Round hold_rounds = 1;
  Round first = 0;         ///< it acts from this round on
  Matrix amplitude;        ///< covariance or intensity; bound; amplitude; value: scalar, one per component, or (covariances) a full matrix
  double frequency = 0.0;  ///< rad/s
  Matrix phase;            ///< rad
};

/// What belongs to one agent.
struct PlantPart {
  Values parameters, initial;
  /// Whose outputs it measures: itself first, the others ascending. With `relative`: whose outputs it measures relative to its own,
  /// ascending.
  std::vector<AgentId> sensed;
  bool relative = false;
  bool absolute = false;  ///< relative: its own output against the origin too
  Attendance presence;
  std::vector<Signal> signals;
  std::vector<AgentId> distances = {};  ///< how far these are away, ascending, follows what it measures: its links ask for it
};

struct PlantTask {
  std::string model;
  Seed seed;
  Seconds dt = 1.0;
  std::vector<PlantPart> parts;  ///< by agent
};

/// The experiment must have a plant.
PlantTask plant_task(const Experiment& experiment, Seed run_seed);

}  // namespace consort
