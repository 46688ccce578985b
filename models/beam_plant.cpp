#include "models/beam_plant.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace consort {
namespace {

using Index = Eigen::Index;

constexpr std::array<Index, 4> kSensors{3, 7, 9, 11};
constexpr Index kDisplaced = 6;

[[noreturn]] void refuse(const std::string& what, double found, const std::string& allowed) {
  throw ConfigError("beam: parameter '" + what + "': found " + text_of(found) + "; allowed: " + allowed);
}

Index whole(const Values& given, const std::string& name, Index fallback, Index low, Index high) {
  const double value = given.scalar(name, static_cast<double>(fallback));
  if (!(value >= static_cast<double>(low) && value <= static_cast<double>(high)) || value != std::floor(value))
    refuse(name, value, "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
  return static_cast<Index>(value);
}

Beam beam_of(const Values& given) {
  const Beam thesis;
  Beam beam;
  beam.elements = whole(given, "elements", thesis.elements, 2, 200);
  beam.length = given.scalar("length", thesis.length);
  beam.line_mass = given.scalar("line_mass", thesis.line_mass);
  beam.bending = given.scalar("bending", thesis.bending);
  beam.axial = given.scalar("axial", thesis.axial);
  beam.tension = given.scalar("tension", thesis.tension);
  beam.mass_damping = given.scalar("mass_damping", thesis.mass_damping);
  beam.stiffness_damping = given.scalar("stiffness_damping", thesis.stiffness_damping);
  return beam;
}

// Seen from `nodes` (one row of C each) after a displacement of 1 mm.
ModalModel model_of(const Values& given, const std::vector<Index>& nodes) {
  const bool table = given.scalar("reduction", 0.0) == 0.0;
  const Index displaced = whole(given, "displaced", kDisplaced, 1, 199);
  if (!table) return modal_model(bending_modes(beam_of(given), whole(given, "modes", 4, 1, 398)), nodes, displaced, 1.0);
  // The thesis' frequencies with the shapes of a plain beam of 15 elements; the whole frequencies are printed there, C and z(0) are not.
  const Vector omega{{89, 221, 409, 651}};
  const Matrix C{{.2034645, .1596524, .1078220, .0593079},
                 {.5167411, .0498207, -.0937838, -.0288264},
                 {.4781017, -.1368728, -.0449330, .0626472},
                 {.3097591, -.1966885, .0886445, -.0109810}};
  const Vector z{{.293990718, .512550261, -.564447737, -1.9485538}};
  if (displaced != kDisplaced) refuse("displaced", static_cast<double>(displaced), "6 with the table; any with reduction: finite_elements");
  const Vector damping = given.scalar("mass_damping", 1e-5) + given.scalar("stiffness_damping", 1e-6) * omega.array().square();
  ModalModel out{modal_dynamics(omega, damping), Matrix::Zero(static_cast<Index>(nodes.size()), 8), Vector::Zero(8)};
  for (std::size_t s = 0; s < nodes.size(); ++s) {
    const auto row = std::find(kSensors.begin(), kSensors.end(), nodes[s]) - kSensors.begin();
    if (row == static_cast<std::ptrdiff_t>(kSensors.size()))
      refuse("sensor", static_cast<double>(nodes[s]), "3, 7, 9, 11 with the table, 0 for none; any with reduction: finite_elements");
    for (Index j = 0; j < 4; ++j) out.C(static_cast<Index>(s), 2 * j) = C(row, j);
  }
  for (Index j = 0; j < 4; ++j) out.z[2 * j] = z[j];
  return out;
}

void require_common(std::span<const Values> all, std::string_view except) {
  for (std::size_t i = 1; i < all.size(); ++i) {
    for (const Values* one : {&all[0], &all[i]}) {
      const Values& other = one == &all[0] ? all[i] : all[0];
      for (const Values::Entry& entry : one->entries()) {
        if (entry.name == except) continue;
        const Matrix* same = other.find(entry.name);
        if (same == nullptr || *same != entry.value)
          throw ConfigError("beam: agent " + std::to_string(i + 1) + ": found another '" + entry.name +
                            "' than that of agent 1; allowed: one beam for all");
      }
    }
  }
}

Vector start(const Values& initial, const Vector& per_millimetre) {
  if (!initial.has("x")) return initial.scalar("displacement", 10.0) * per_millimetre;
  const Vector x = initial.vector("x");
  if (x.size() == per_millimetre.size()) return x;
  if (x.size() == 1) return Vector::Constant(per_millimetre.size(), x[0]);
  throw ConfigError("beam: initial 'x': found " + std::to_string(x.size()) + " numbers; allowed: " + std::to_string(per_millimetre.size()) +
                    ", two per mode");
}

}  // namespace

BeamPlant beam_plant(std::span<const Values> parameters, std::span<const Values> initial) {
  check(!parameters.empty() && parameters.size() == initial.size(), "beam_plant: one set of values per agent");
  require_common(parameters, "sensor");
  require_common(initial, "");
  std::vector<Index> nodes;
  std::vector<Index> row;  // by agent: of its sensor; -1: none
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Index node = whole(parameters[i], "sensor", i < kSensors.size() ? kSensors[i] : 0, 0, 199);
    row.push_back(node == 0 ? -1 : static_cast<Index>(nodes.size()));
    if (node != 0) nodes.push_back(node);
  }
  const ModalModel model = model_of(parameters[0], nodes);
  const double cutoff = parameters[0].scalar("cutoff", 0.055);
  BeamPlant out{model.A, {}, start(initial[0], model.z)};
  for (const Index r : row) {
    if (r < 0)
      out.C.emplace_back(0, model.A.cols());
    else
      out.C.emplace_back(model.C.row(r).unaryExpr([&](double entry) { return std::abs(entry) < cutoff ? 0.0 : entry; }));
  }
  return out;
}

}  // namespace consort
