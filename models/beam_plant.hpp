#pragma once
/// The beam of Knotek's thesis as a plant: its modes, a sensor per agent, and what it is let go from, out of named values.

#include "core/value_doc.hpp"
#include "models/beam_modes.hpp"

#include <array>
#include <span>

namespace consort {

inline constexpr std::array kBeamParameters{
    ValueDoc{"reduction", "one of table, finite_elements", "table", "the four modes of the thesis, or those of the finite elements"},
    ValueDoc{"sensor", "scalar", "3, 7, 9, 11 of agents 1 to 4", "free node whose displacement the agent measures; 0: none"},
    ValueDoc{"cutoff", "scalar", "0.055", "entries of C below it are zero: the mode counts as not seen"},
    ValueDoc{"displaced", "scalar", "6", "free node that is displaced at the start"},
    ValueDoc{"modes", "scalar", "4", "finite_elements: modes kept, from the lowest"},
    ValueDoc{"elements", "scalar", "15", "finite_elements: their number"},
    ValueDoc{"length", "scalar", "1500", "finite_elements: L, mm"},
    ValueDoc{"line_mass", "scalar", "7.8e-7", "finite_elements: rho A, t/mm"},
    ValueDoc{"bending", "scalar", "3.7868e7", "finite_elements: E I, N mm^2"},
    ValueDoc{"axial", "scalar", "2.1e7", "finite_elements: E A, N"},
    ValueDoc{"tension", "scalar", "457.98", "finite_elements: axial tension, N; 0: none"},
    ValueDoc{"mass_damping", "scalar", "1e-5", "a of D = a M + b K, 1/s"},
    ValueDoc{"stiffness_damping", "scalar", "1e-6", "b of D = a M + b K, s"}};
inline constexpr std::array kBeamInitial{ValueDoc{"displacement", "scalar", "10", "of the displaced node, mm"},
                                         ValueDoc{"x", "vector 2 * modes", "from the displacement", "the whole state, mode by mode"}};

struct BeamPlant {
  Matrix A;               ///< 2 l x 2 l, one block per mode
  std::vector<Matrix> C;  ///< by agent: 1 x 2 l, or 0 x 2 l without a sensor
  Vector x;               ///< 2 l
};

/// One plant for all agents: everything but `sensor` must be the same. Throws ConfigError naming parameter, what was found, what is
/// allowed; with the table, sensors are at 3, 7, 9, 11 and the displaced node is 6.
BeamPlant beam_plant(std::span<const Values> parameters, std::span<const Values> initial);

}  // namespace consort
