#pragma once
/// A beam clamped at both ends as finite elements: mass, stiffness and damping, modes, and the modal state-space model of a few of them.
///
/// Two-node elements with three degrees of freedom per node: axial displacement u, transverse displacement w, rotation theta = dw/dx.
/// Euler-Bernoulli bending with consistent mass, a bar for the axial part, and the geometric stiffness of an axial tension. Mass and
/// stiffness give Rayleigh damping D = a M + b K, under which the modes stay apart:
///
///     M q'' + D q' + K q = 0,    K phi_j = omega_j^2 M phi_j,    phi_j' M phi_j = 1,    2 zeta_j omega_j = a + b omega_j^2
///     z_j = [omega_j q_mj, q_mj'],    z_j' = [0 omega_j; -omega_j -2 zeta_j omega_j] z_j                               (3.102)-(3.104)
///
/// Source: Knotek, thesis, section 3.6 (the beam, its damping and the modal form); the element matrices are those of every textbook
/// (Przemieniecki, "Theory of Matrix Structural Analysis", 1968). Units: mm, N, t, s.

#include "core/types.hpp"

#include <vector>

namespace consort {

/// The beam of the thesis. A plain steel beam has other ratios between its frequencies; this tension and this bending stiffness bring
/// 89.24, 220.07, 407.45, 654.39 rad/s, next to the thesis' 89, 221, 409, 651.
struct Beam {
  Eigen::Index elements = 15;
  double length = 1500.0;           ///< mm
  double line_mass = 7.8e-7;        ///< rho A, t/mm
  double bending = 3.7868e7;        ///< E I, N mm^2
  double axial = 2.1e7;             ///< E A, N
  double tension = 457.98;          ///< N; 0: none
  double mass_damping = 1e-5;       ///< a, 1/s
  double stiffness_damping = 1e-6;  ///< b, s
};

/// Degrees of freedom of the free nodes 1..elements - 1, node after node: u, w, theta. All n x n, n = 3 (elements - 1).
struct BeamMatrices {
  Matrix mass, stiffness, damping;
};

/// Throws ConfigError on fewer than two or more than 200 elements and on a property that is not positive (tension, dampings: not negative).
BeamMatrices assemble(const Beam& beam);

/// Modes that bend, by ascending frequency, mass-normalised, each with positive displacement of free node 1.
struct BeamModes {
  Vector omega;    ///< rad/s, one per mode
  Vector damping;  ///< 2 zeta omega = a + b omega^2, 1/s
  Matrix shapes;   ///< (elements - 1) x modes: phi_j at the free nodes, 1 / sqrt(t)
  Matrix momenta;  ///< (elements - 1) x modes: phi_j' M of a unit transverse displacement of each free node alone
};

/// The first `count` of them. Throws as assemble(), and ConfigError if the model has fewer.
BeamModes bending_modes(const Beam& beam, Eigen::Index count);

/// Frequencies of the axial modes, rad/s, ascending. Throws as assemble().
Vector axial_frequencies(const Beam& beam);

/// The modal model of some modes, seen by displacement sensors and let go from a displacement of one node.
struct ModalModel {
  Matrix A;  ///< 2 l x 2 l, one block (3.104) per mode
  Matrix C;  ///< p x 2 l: y = displacement at each sensor, mm
  Vector z;  ///< 2 l
};
/// `sensors` and `displaced` count free nodes from 1; `displacement` in mm. Throws ConfigError on a node that is not free.
ModalModel modal_model(const BeamModes& modes, const std::vector<Eigen::Index>& sensors, Eigen::Index displaced, double displacement);

/// The blocks (3.104) of modes with frequencies omega (rad/s) and damping 2 zeta omega (1/s).
Matrix modal_dynamics(const Vector& omega, const Vector& damping);

}  // namespace consort
