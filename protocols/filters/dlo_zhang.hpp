#pragma once
/// Agents observe a plant made of separate parts over a directed graph: the parts an agent sees it estimates from its own measurement
/// alone, the others it takes over from those it hears.
///
///     xhat_i' = A xhat_i + L_i (y_i - C_i xhat_i) + F_i sum_j w_ij (xhat_j - xhat_i)                                         (3.13)
///     L_i = T_i [L_io; 0],   F_i = T_i diag(0, c_j F_j) T_i',   F_j = R_j^-1 P_j                                           (3.14)
///     T_i'A T_i = diag(A_io, A_iu),   C_i T_i = [C_io 0],   (A_io, C_io) observable                                        (3.15)
///     A_j'P_j + P_j A_j - P_j R_j^-1 P_j + Q_j = 0                                                                         (3.16)
///
/// Source: Zhang et al. as printed in Knotek, thesis, (3.13)-(3.16). State groups A_j are the blocks of A, found from its zeros; T_i sorts
/// them. L_io, which the source leaves open, is the gain of the stationary Kalman-Bucy filter for noise of intensities Q and R.
/// c = c_j for all groups; `coupling_Q` and `coupling_R` hold Q_j and R_j as blocks.
/// x is corrected and predicted in rounds (protocols/filters/estimator_network.hpp), for large c stably unless those who do not see a group
/// hear each other in a circle.
/// Assumes: no noise; A block diagonal; a group that C_i touches is seen whole (Assumption 5, else the protocol refuses it); every group is
/// seen by somebody from whom a path leads to everybody who does not see it (Assumptions 6, 7); c large enough.
/// A missing message is an absent term in the sum for that round; a late xhat_j is moved on with the plant. w_ij is the weight of the edge.
/// Link noise disturbs xhat_j. An agent without a sensor takes over everything.

#include "protocols/filters/luenberger_base.hpp"
#include "protocols/filters/theory.hpp"

namespace consort {

struct DloZhang : LuenbergerObserver {
  static constexpr std::string_view name = "dlo_zhang";
  static constexpr std::string_view summary = "Luenberger observers that take over from others the parts they do not see";
  static constexpr std::string_view source = "Knotek, thesis, (3.13)-(3.16) (Zhang et al.)";
  static constexpr std::string_view assumptions =
      "one plant seen by all, A block diagonal; who sees a group reaches all others; c large enough";
  static constexpr bool needs_plant = true;
  static constexpr Truth truth = Truth::state;
  static constexpr auto examine = examine_dlo_zhang;
  static constexpr std::array parameters =
      joined(joined(std::array{ValueDoc{"c", "scalar", "", "coupling gain, > 0"}}, design),
             std::array{ValueDoc{"coupling_Q", "covariance n x n (scalar, diagonal or matrix)", "1", "Q_j of (3.16), > 0, as blocks"},
                        ValueDoc{"coupling_R", "covariance n x n (scalar, diagonal or matrix)", "1", "R_j of (3.16), > 0, as blocks"}});

  static Params params(const Values& values, const Setup& setup) {
    ObservedPlant plant = observed_plant(name, setup);
    const auto [Q, R] = weights(values, plant);
    const Eigen::Index n = plant.A.rows();
    const double c = positive_parameter(name, values, "c", {});
    try {
      const ObserverGains gains = zhang_gains(plant.A, plant.C, Q, R, c, values.covariance("coupling_Q", n, 1.0, true),
                                              values.covariance("coupling_R", n, 1.0, true));
      return with(name, std::move(plant), gains, setup.dt);
    } catch (const ConfigError& error) {
      throw ConfigError("protocol dlo_zhang: agent " + std::to_string(setup.self.value) + ": " + error.what());
    }
  }
};

}  // namespace consort
