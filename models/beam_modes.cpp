#include "models/beam_modes.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"
#include "core/number_text.hpp"

#include <array>
#include <cmath>
#include <string>

namespace consort {
namespace {

using Element = Eigen::Matrix<double, 6, 6>;  // u, w, theta of its left node, then of its right one
using Bend = Eigen::Matrix4d;                 // w, theta of both nodes

// Puts the 2 x 2 matrix of a bar and the 4 x 4 matrix of a beam into their places among the six degrees of freedom.
Element element(const Eigen::Matrix2d& bar, const Bend& bend) {
  static constexpr std::array<Eigen::Index, 2> kAxial{0, 3};
  static constexpr std::array<Eigen::Index, 4> kBending{1, 2, 4, 5};
  Element out = Element::Zero();
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t j = 0; j < 2; ++j) out(kAxial[i], kAxial[j]) = bar(static_cast<int>(i), static_cast<int>(j));
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t j = 0; j < 4; ++j) out(kBending[i], kBending[j]) = bend(static_cast<int>(i), static_cast<int>(j));
  return out;
}

Element element_mass(const Beam& beam, double l) {
  const Eigen::Matrix2d bar{{2, 1}, {1, 2}};
  const Bend bend{{156, 22 * l, 54, -13 * l},
                  {22 * l, 4 * l * l, 13 * l, -3 * l * l},
                  {54, 13 * l, 156, -22 * l},
                  {-13 * l, -3 * l * l, -22 * l, 4 * l * l}};
  const double mass = beam.line_mass * l;
  return element(mass / 6.0 * bar, mass / 420.0 * bend);
}

Element element_stiffness(const Beam& beam, double l) {
  const Eigen::Matrix2d bar{{1, -1}, {-1, 1}};
  const Bend bend{
      {12, 6 * l, -12, 6 * l}, {6 * l, 4 * l * l, -6 * l, 2 * l * l}, {-12, -6 * l, 12, -6 * l}, {6 * l, 2 * l * l, -6 * l, 4 * l * l}};
  const Bend string{
      {36, 3 * l, -36, 3 * l}, {3 * l, 4 * l * l, -3 * l, -l * l}, {-36, -3 * l, 36, -3 * l}, {3 * l, -l * l, -3 * l, 4 * l * l}};
  return element(beam.axial / l * bar, beam.bending / (l * l * l) * bend + beam.tension / (30.0 * l) * string);
}

// Sums the elements and leaves out the two clamped nodes.
Matrix assembled(const Element& part, Eigen::Index elements) {
  Matrix all = Matrix::Zero(3 * (elements + 1), 3 * (elements + 1));
  for (Eigen::Index e = 0; e < elements; ++e) all.block<6, 6>(3 * e, 3 * e) += part;
  return all.block(3, 3, 3 * (elements - 1), 3 * (elements - 1));
}

void require(bool good, const std::string& what, double found, const std::string& allowed) {
  if (!good) throw ConfigError("beam: " + what + ": found " + number_text(found) + "; allowed: " + allowed);
}

// Entries of the free nodes that start with degree of freedom `first`, every third.
auto every_third(Eigen::Index first, Eigen::Index nodes) { return Eigen::seqN(first, nodes, 3); }

}  // namespace

BeamMatrices assemble(const Beam& beam) {
  require(beam.elements >= 2 && beam.elements <= 200, "elements", static_cast<double>(beam.elements), "2 to 200");
  require(beam.length > 0.0, "length", beam.length, "above 0");
  require(beam.line_mass > 0.0, "mass per length", beam.line_mass, "above 0");
  require(beam.bending > 0.0, "bending stiffness", beam.bending, "above 0");
  require(beam.axial > 0.0, "axial stiffness", beam.axial, "above 0");
  require(beam.tension >= 0.0, "tension", beam.tension, "0 or above");
  require(beam.mass_damping >= 0.0, "damping of the mass", beam.mass_damping, "0 or above");
  require(beam.stiffness_damping >= 0.0, "damping of the stiffness", beam.stiffness_damping, "0 or above");
  const double l = beam.length / static_cast<double>(beam.elements);
  BeamMatrices out{assembled(element_mass(beam, l), beam.elements), assembled(element_stiffness(beam, l), beam.elements), {}};
  out.damping = beam.mass_damping * out.mass + beam.stiffness_damping * out.stiffness;
  return out;
}

BeamModes bending_modes(const Beam& beam, Eigen::Index count) {
  const BeamMatrices m = assemble(beam);
  const Eigen::Index nodes = beam.elements - 1, n = 3 * nodes;
  const auto [squares, modes] = symmetric_eigen(m.stiffness, m.mass, "the beam");  // of omega^2; phi' M phi = 1
  BeamModes out{Vector(count), Vector(count), Matrix(nodes, count), Matrix(nodes, count)};
  Eigen::Index found = 0;
  for (Eigen::Index j = 0; j < n && found < count; ++j) {
    const Vector phi = modes.col(j);
    const Vector momentum = m.mass * phi;
    // Axial and bending degrees of freedom are not coupled: a mode is one or the other, so half its kinetic energy decides.
    const auto axial = every_third(0, nodes);
    if (phi(axial).dot(momentum(axial)) > 0.5) continue;
    const double sign = phi[1] < 0.0 ? -1.0 : 1.0;
    out.omega[found] = std::sqrt(squares[j]);
    out.damping[found] = beam.mass_damping + beam.stiffness_damping * squares[j];
    out.shapes.col(found) = sign * phi(every_third(1, nodes));
    out.momenta.col(found) = sign * momentum(every_third(1, nodes));
    ++found;
  }
  require(found == count, "number of modes", static_cast<double>(count), "at most the " + std::to_string(found) + " that bend");
  return out;
}

Vector axial_frequencies(const Beam& beam) {
  const BeamMatrices m = assemble(beam);
  const auto axial = every_third(0, beam.elements - 1);
  const Matrix stiffness = m.stiffness(axial, axial), mass = m.mass(axial, axial);
  return symmetric_eigen(stiffness, mass, "the beam's axial motion").values.cwiseSqrt();
}

Matrix modal_dynamics(const Vector& omega, const Vector& damping) {
  Matrix A = Matrix::Zero(2 * omega.size(), 2 * omega.size());
  for (Eigen::Index j = 0; j < omega.size(); ++j) A.block<2, 2>(2 * j, 2 * j) << 0, omega[j], -omega[j], -damping[j];
  return A;
}

ModalModel modal_model(const BeamModes& modes, const std::vector<Eigen::Index>& sensors, Eigen::Index displaced, double displacement) {
  const Eigen::Index nodes = modes.shapes.rows(), l = modes.omega.size();
  const auto row_of = [&](Eigen::Index node) {
    require(node >= 1 && node <= nodes, "free node", static_cast<double>(node), "1 to " + std::to_string(nodes));
    return node - 1;
  };
  ModalModel out{modal_dynamics(modes.omega, modes.damping), Matrix::Zero(static_cast<Eigen::Index>(sensors.size()), 2 * l),
                 Vector::Zero(2 * l)};
  for (Eigen::Index j = 0; j < l; ++j) {
    // w = sum_j phi_j q_mj = sum_j (phi_j / omega_j) z_ja;  q_mj(0) = phi_j' M q(0)
    for (std::size_t s = 0; s < sensors.size(); ++s)
      out.C(static_cast<Eigen::Index>(s), 2 * j) = modes.shapes(row_of(sensors[s]), j) / modes.omega[j];
    out.z[2 * j] = modes.omega[j] * modes.momenta(row_of(displaced), j) * displacement;
  }
  return out;
}

}  // namespace consort
