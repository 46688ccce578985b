#pragma once
/// Agents that each see a part of the plant, or nothing, observe all of it: each injects its measurement where it sees, and moves towards
/// its neighbours' estimates everywhere, less where it sees for itself.
///
///     xhat_i' = A xhat_i + L_i (y_i - C_i xhat_i) + gamma M_i(k_i)^-1 sum_j w_ij (xhat_j - xhat_i)                              (3.9)
///     L_i = T_i [L_io; 0],   M_i(k_i) = T_i diag(k_i M_io, I) T_i'                                                         (3.10)
///     T_i'A T_i = [A_io 0; A_ir A_iu],   C_i T_i = [C_io 0],   (A_io, C_io) observable, T_i orthonormal                    (3.11)
///     (A_io - L_io C_io)'M_io + M_io (A_io - L_io C_io) = -I                                                               (3.12)
///
/// Source: Kim et al. as printed in Knotek, thesis, (3.9)-(3.12). It leaves L_io open as long as A_io - L_io C_io is stable: here it is the
/// gain of the stationary Kalman-Bucy filter for noise of intensities Q and R.
/// x is corrected and predicted in rounds (protocols/filters/estimator_network.hpp); `consort validate` says how long they may be: a large
/// gamma makes neighbours jump to each other's estimates, which never meet on an even ring.
/// Assumes: no noise; undirected connected graph; (A, C) of all together detectable; gamma and k_i large enough.
/// A missing message is an absent term in the sum for that round; a late xhat_j is moved on with the plant. w_ij is the weight of the edge.
/// Link noise disturbs xhat_j. An agent without a sensor follows its neighbours with gain gamma.

#include "protocols/filters/luenberger_base.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct DloKim : LuenbergerObserver {
  static constexpr std::string_view name = "dlo_kim";
  static constexpr std::string_view summary = "Luenberger observers that each see a part and agree on the rest";
  static constexpr std::string_view source = "Knotek, thesis, (3.9)-(3.12) (Kim et al.)";
  static constexpr std::string_view assumptions = "one plant seen by all; undirected, connected; (A, C) detectable; gamma, k large enough";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_dlo_kim;
  static constexpr std::array parameters = joined(std::array{ValueDoc{"gamma", "scalar", "", "coupling gain, 1/s, > 0"},
                                                             ValueDoc{"k", "scalar", "1", "k_i, weight of the part the agent sees, > 0"}},
                                                  design);

  static Params params(const Values& values, const Setup& setup) {
    ObservedPlant plant = observed_plant(name, setup);
    const auto [Q, R] = weights(values, plant);
    const ObserverGains gains =
        kim_gains(plant.A, plant.C, Q, R, positive_parameter(name, values, "gamma", {}), positive_parameter(name, values, "k", 1.0));
    return with(name, std::move(plant), gains, setup.dt);
  }
};

}  // namespace consort
