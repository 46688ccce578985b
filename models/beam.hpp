#pragma once
/// A slender beam clamped at both ends, reduced to its lowest bending modes; every agent may have a displacement sensor somewhere on it:
///
///     z_j' = [0 omega_j; -omega_j -2 zeta_j omega_j] z_j + d_j,    y_i = sum_j (phi_j(node of i) / omega_j) z_ja
///
/// z_j = [omega_j q_mj, q_mj'] are displacement and velocity of mode j in mm/s. Source: Knotek, thesis, section 3.6: omega = 89, 221, 409,
/// 651 rad/s (the thesis prints Hz; its variances need rad/s), 2 zeta omega = 1e-5 + 1e-6 omega^2, sensors at free nodes 3, 7, 9, 11 of 14.
/// The thesis does not print C; ours is that of a plain beam of 15 finite elements at those frequencies, which gives its covariances to a
/// few per cent (models/beam_modes.hpp). No control acts.

#include "models/beam_plant.hpp"
#include "models/shared_linear.hpp"

namespace consort {

struct ClampedBeam {
  static constexpr std::string_view name = "beam";
  static constexpr std::string_view summary =
      "the lowest bending modes of a clamped beam, one for all agents; some have a displacement sensor";
  static constexpr bool shared = true;
  static constexpr std::span<const ValueDoc> parameters = kBeamParameters;
  static constexpr std::span<const ValueDoc> initial = kBeamInitial;

  static std::unique_ptr<PlantModel> make(const PlantSetup& setup) {
    const BeamPlant beam = beam_plant(setup.parameters, setup.initial);
    const Eigen::Index n = beam.A.rows();
    std::vector<SharedPlant::Part> parts;
    for (const Matrix& C : beam.C) parts.push_back({Matrix(n, 0), C});
    Layout layout;
    for (Eigen::Index mode = 1; mode <= n / 2; ++mode) layout.fields.push_back({"mode" + std::to_string(mode), 2, 1});
    return std::make_unique<SharedPlant>(beam.A, std::move(parts), beam.x, std::move(layout), setup.dt);
  }
};

}  // namespace consort
