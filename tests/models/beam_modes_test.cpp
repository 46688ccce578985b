// The clamped beam of Knotek's thesis, section 3.6, against analytic frequencies and against the numbers the thesis gives.

#include "models/beam_modes.hpp"

#include "core/math/decompositions.hpp"
#include "models/beam_plant.hpp"
#include "tests/core/math/systems.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace consort {
namespace {

using cases::complaint;

Beam plain() {
  Beam beam;
  beam.tension = 0.0;
  return beam;
}

TEST(Beam, PlainFrequenciesAreTheAnalyticOnesOfAClampedClampedBeam) {
  // cos(b L) cosh(b L) = 1;  omega = b^2 sqrt(EI / (rho A))
  const Vector bL{{4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464}};
  const Beam beam = plain();
  const BeamModes modes = bending_modes(beam, 4);
  const Vector exact = (bL / beam.length).cwiseAbs2() * std::sqrt(beam.bending / beam.line_mass);
  for (Eigen::Index j = 0; j < 4; ++j) {
    SCOPED_TRACE(j);
    // Elements of length l are too stiff by (b l)^4 / 1440, to leading order.
    const double leading = std::pow(bL[j] / static_cast<double>(beam.elements), 4) / 1440.0;
    EXPECT_NEAR((modes.omega[j] / exact[j] - 1.0) / leading, 1.0, 0.05);
  }
  const Vector ratios = modes.omega / modes.omega[0];
  EXPECT_NEAR(ratios[1], 2.757, 2e-3);
  EXPECT_NEAR(ratios[2], 5.405, 4e-3);
  EXPECT_NEAR(ratios[3], 8.938, 6e-3);
}

TEST(Beam, FrequenciesConvergeWithTheFourthPowerOfTheElement) {
  Beam coarse = plain(), fine = plain();
  coarse.elements = 10;
  fine.elements = 20;
  const double exact = std::pow(4.730040744862704 / coarse.length, 2) * std::sqrt(coarse.bending / coarse.line_mass);
  const double ratio = (bending_modes(coarse, 1).omega[0] - exact) / (bending_modes(fine, 1).omega[0] - exact);
  EXPECT_NEAR(ratio, 16.0, 0.5);
}

TEST(Beam, TensionBringsTheFrequenciesOfTheThesis) {
  const BeamModes modes = bending_modes(Beam{}, 4);
  const Vector stated{{89.24, 220.07, 407.45, 654.39}}, thesis{{89, 221, 409, 651}};
  for (Eigen::Index j = 0; j < 4; ++j) {
    EXPECT_NEAR(modes.omega[j], stated[j], 5e-3);
    EXPECT_LT(std::abs(modes.omega[j] / thesis[j] - 1.0), 6e-3);
    EXPECT_NEAR(modes.damping[j], 1e-5 + 1e-6 * modes.omega[j] * modes.omega[j], 1e-14);
  }
}

TEST(Beam, ASquareCentimetreOfSteelHasTheFrequenciesStated) {
  Beam steel = plain();
  steel.bending = 2.1e5 * 1e4 / 12.0;
  const BeamModes modes = bending_modes(steel, 4);
  const Vector stated{{148.9, 410.6, 805.0, 1331.2}};
  for (Eigen::Index j = 0; j < 4; ++j) EXPECT_NEAR(modes.omega[j], stated[j], 0.06);
}

TEST(Beam, AStretchedStringIsTheLimitOfALargeTension) {
  Beam string = plain();
  string.elements = 100;  // the clamped rotation bends the last element, whatever the stiffness: an error of order l
  string.bending = 1e-3;
  string.tension = 500.0;
  const double speed = std::sqrt(string.tension / string.line_mass);
  EXPECT_NEAR(bending_modes(string, 1).omega[0] / (std::numbers::pi * speed / string.length), 1.0, 3e-3);
}

TEST(Beam, AxialModesAreThoseOfABarAndFarAbove) {
  const Beam beam;
  const Vector axial = axial_frequencies(beam);
  ASSERT_EQ(axial.size(), 14);
  const double exact = std::numbers::pi / beam.length * std::sqrt(beam.axial / beam.line_mass);
  EXPECT_NEAR(axial[0] / exact, 1.0, 2e-3);
  EXPECT_NEAR(axial[0], 10.9e3, 50.0);
}

TEST(Beam, TheModelHas42DegreesOfFreedomOfWhich28Bend) {
  const BeamMatrices m = assemble(Beam{});
  EXPECT_EQ(m.mass.rows(), 42);
  EXPECT_EQ(m.mass, Matrix(m.mass.transpose()));
  EXPECT_EQ(m.stiffness, Matrix(m.stiffness.transpose()));
  EXPECT_EQ(m.damping, Matrix(1e-5 * m.mass + 1e-6 * m.stiffness));
  EXPECT_EQ(bending_modes(Beam{}, 28).omega.size(), 28);
  EXPECT_EQ(complaint([] { bending_modes(Beam{}, 29); }), "beam: number of modes: found 29; allowed: at most the 28 that bend");
}

TEST(Beam, ModesAreNormalisedToTheMassAndDiagonaliseTheModel) {
  const Beam beam;
  const BeamMatrices m = assemble(beam);
  const BeamModes modes = bending_modes(beam, 28);
  // A unit displacement of every node, w alone, has the modal coordinates phi' M e; all of them together give it back.
  const Matrix back = modes.shapes * modes.momenta.transpose();
  EXPECT_LT((back - Matrix::Identity(14, 14)).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Beam, ModalModelIsTheReductionOfTheWholeOne) {
  // A displaced beam let go: the modal model of all bending modes against the 42 coupled equations, q'' = -M^-1 (D q' + K q).
  Beam beam;
  beam.elements = 4;
  const BeamMatrices m = assemble(beam);
  const ModalModel modal = modal_model(bending_modes(beam, 6), {1, 3}, 2, 10.0);
  const Eigen::Index n = m.mass.rows();
  Matrix A = Matrix::Zero(2 * n, 2 * n);
  A.topRightCorner(n, n).setIdentity();
  A.bottomLeftCorner(n, n) = -solve(m.mass, m.stiffness, "M");
  A.bottomRightCorner(n, n) = -solve(m.mass, m.damping, "M");
  Vector q = Vector::Zero(2 * n);
  q[4] = 10.0;  // w of free node 2
  // y(0) and its derivatives are linear in the state: compare C A^k z.
  Vector full = q, reduced = modal.z;
  for (int k = 0; k < 4; ++k) {
    SCOPED_TRACE(k);
    const Vector y = modal.C * reduced;
    const double scale = std::max({1.0, std::abs(y[0]), std::abs(y[1])});
    EXPECT_NEAR(y[0], full[1], 1e-8 * scale);
    EXPECT_NEAR(y[1], full[7], 1e-8 * scale);
    full = (A * full).eval();
    reduced = (modal.A * reduced).eval();
  }
}

TEST(Beam, NamesAPropertyThatMakesNoSense) {
  Beam beam;
  beam.elements = 1;
  EXPECT_EQ(complaint([&] { assemble(beam); }), "beam: elements: found 1; allowed: 2 to 200");
  beam = {};
  beam.tension = -1;
  EXPECT_EQ(complaint([&] { assemble(beam); }), "beam: tension: found -1; allowed: 0 or above");
  EXPECT_EQ(complaint([] { modal_model(bending_modes(Beam{}, 4), {15}, 6, 10); }), "beam: free node: found 15; allowed: 1 to 14");
}

// Sensors at free nodes 3, 7, 9, 11; entries of the displacements, unrounded by Assumption 8.
const Matrix kC{{.2034645, .1596524, .1078220, .0593079},
                {.5167411, .0498207, -.0937838, -.0288264},
                {.4781017, -.1368728, -.0449330, .0626472},
                {.3097591, -.1966885, .0886445, -.0109810}};

TEST(Beam, ShapesOfThePlainBeamAtTheFrequenciesOfTheThesisAreTheStatedC) {
  BeamModes modes = bending_modes(plain(), 4);
  modes.omega = Vector{{89, 221, 409, 651}};
  const ModalModel model = modal_model(modes, {3, 7, 9, 11}, 6, 10.0);
  for (Eigen::Index j = 0; j < 4; ++j) {
    SCOPED_TRACE(j);
    EXPECT_LT((model.C.col(2 * j) - kC.col(j)).cwiseAbs().maxCoeff(), 6e-8);
    EXPECT_TRUE(model.C.col(2 * j + 1).isZero(0.0));
  }
  // z(0) of free node 6 displaced by 10 mm, next to the thesis' 2.9, 5.2, 6.2, 21.5
  const Vector stated{{2.94, 5.13, -5.64, -19.49}};
  for (Eigen::Index j = 0; j < 4; ++j) EXPECT_NEAR(model.z[2 * j], stated[j], 6e-3);
}

TEST(Beam, StretchedModelIsWithinAFewPercentOfTheTable) {
  BeamModes modes = bending_modes(Beam{}, 4);
  modes.omega = Vector{{89, 221, 409, 651}};
  const ModalModel model = modal_model(modes, {3, 7, 9, 11}, 6, 10.0);
  const Vector stated{{2.92, 5.06, -5.87, -19.58}}, thesis{{2.9, 5.2, -6.2, -21.5}};
  for (Eigen::Index j = 0; j < 4; ++j) {
    SCOPED_TRACE(j);
    EXPECT_NEAR(model.z[2 * j], stated[j], 6e-3);
    EXPECT_LT(std::abs(model.z[2 * j] / thesis[j] - 1.0), 0.1);
    EXPECT_LT((model.C.col(2 * j) - kC.col(j)).cwiseAbs().maxCoeff(), 0.05 * kC.col(j).cwiseAbs().maxCoeff());
  }
}

BeamPlant plant_of(const std::vector<std::pair<std::string, double>>& common, std::size_t agents = 6, double sensor_of_1 = -1) {
  std::vector<Values> parameters(agents), initial(agents);
  for (Values& own : parameters)
    for (const auto& [name, value] : common) own.set(name, value);
  if (sensor_of_1 >= 0) parameters[0].set("sensor", sensor_of_1);
  return beam_plant(parameters, initial);
}

TEST(BeamPlant, TableHasTheStatedSensorsWithTheirSmallEntriesZeroed) {
  const BeamPlant plant = plant_of({});
  ASSERT_EQ(plant.C.size(), 6U);
  const Matrix seen{{1, 1, 1, 1}, {1, 0, 1, 0}, {1, 1, 0, 1}, {1, 1, 1, 0}};  // O_1 .. O_4
  for (Eigen::Index i = 0; i < 4; ++i)
    for (Eigen::Index j = 0; j < 4; ++j) {
      EXPECT_EQ(plant.C[static_cast<std::size_t>(i)](0, 2 * j), seen(i, j) * kC(i, j));
      EXPECT_EQ(plant.C[static_cast<std::size_t>(i)](0, 2 * j + 1), 0.0);
    }
  EXPECT_EQ(plant.C[4].rows(), 0);
  EXPECT_EQ(plant.C[5].rows(), 0);
  EXPECT_EQ(plant_of({{"cutoff", 0}}).C[1](0, 2), .0498207);
  const Vector damping{{.007931, .048851, .167291, .423811}};
  for (Eigen::Index j = 0; j < 4; ++j) EXPECT_NEAR(-plant.A(2 * j + 1, 2 * j + 1), damping[j], 1e-12);
  EXPECT_EQ(plant.A(0, 1), 89.0);
}

TEST(BeamPlant, TableStartsFromTheDisplacementThatThePlainBeamHasThere) {
  BeamModes modes = bending_modes(plain(), 4);
  modes.omega = Vector{{89, 221, 409, 651}};
  EXPECT_LT((plant_of({}).x - modal_model(modes, {}, 6, 10.0).z).norm(), 1e-7);
}

TEST(BeamPlant, FiniteElementsSeeTheSameModesAndAreWithinAFewPercent) {
  const BeamPlant table = plant_of({}), elements = plant_of({{"reduction", 1}});
  EXPECT_LT((elements.A - table.A).cwiseAbs().maxCoeff(), 0.01 * 651);
  for (std::size_t i = 0; i < 4; ++i)
    for (Eigen::Index c = 0; c < 8; ++c) {
      EXPECT_EQ(elements.C[i](0, c) == 0.0, table.C[i](0, c) == 0.0) << i << c;
      EXPECT_NEAR(elements.C[i](0, c), table.C[i](0, c), 0.04 * std::abs(table.C[i](0, c)));
    }
  EXPECT_LT((elements.x - table.x).norm(), 0.03 * table.x.norm());
  EXPECT_EQ(plant_of({{"reduction", 1}, {"modes", 6}}, 2, 12).A.rows(), 12);
}

TEST(BeamPlant, RefusesWhatTheTableDoesNotHold) {
  EXPECT_EQ(complaint([] { plant_of({}, 6, 5); }),
            "beam: parameter 'sensor': found 5; allowed: 3, 7, 9, 11 with the table, 0 for none; any with reduction: finite_elements");
  EXPECT_EQ(complaint([] {
              plant_of({{"displaced", 7}});
            }),
            "beam: parameter 'displaced': found 7; allowed: 6 with the table; any with reduction: finite_elements");
  EXPECT_EQ(complaint([] {
              plant_of({{"reduction", 1}, {"elements", 2.5}});
            }),
            "beam: parameter 'elements': found 2.5; allowed: a whole number from 2 to 200");
  std::vector<Values> parameters(2), initial(2);
  parameters[1].set("tension", 3.0);
  EXPECT_EQ(complaint([&] { beam_plant(parameters, initial); }),
            "beam: agent 2: found another 'tension' than that of agent 1; allowed: one beam for all");
}

}  // namespace
}  // namespace consort
