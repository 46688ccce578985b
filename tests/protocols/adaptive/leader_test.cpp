/// Nothing moves a leader: whoever hears nobody steers nothing and keeps its value, whatever the protocol, its parameters and initial
/// values.

#include "protocols/adapter.hpp"
#include "protocols/registry.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

namespace consort {
namespace {

/// Values unlike the defaults; those that are not free are set so that they fit.
Values unusual(std::span<const ValueDoc> docs, Eigen::Index n, std::size_t choice) {
  static const std::map<std::string, double, std::less<>> kFitting{{"sampling", 20.0}, {"window", 1.0}, {"S", 2.9}, {"xi", 0.6},
                                                                   {"steps", 3.0},     {"r", -0.4},     {"q", 0.8}};
  Values out;
  double value = 1.3;
  for (const ValueDoc& doc : docs) {
    const auto words = choices_of(doc);
    if (const auto fitting = kFitting.find(doc.name); fitting != kFitting.end())
      out.set(doc.name, fitting->second);
    else if (!words.empty())
      out.set(doc.name, static_cast<double>(choice % words.size()));
    else if (doc.shape == kSwitch)
      out.set(doc.name, static_cast<double>(choice % 2));
    else if (doc.shape == "vector n")
      out.set(doc.name, Matrix(Vector::LinSpaced(n, value, -value)));
    else if (doc.shape == "vector 3")
      out.set(doc.name, Matrix(Vector::LinSpaced(3, value, -value / 2.0)));
    else
      out.set(doc.name, value);
    value += 0.1;
  }
  return out;
}

/// A chain of `order` integrators, measured whole.
Values integrators(Eigen::Index order) {
  Values model;
  Matrix A = Matrix::Zero(order, order);
  for (Eigen::Index i = 0; i + 1 < order; ++i) A(i, i + 1) = 1.0;
  model.set("A", A);
  model.set("B", Matrix(Matrix::Identity(order, order).rightCols(1)));
  model.set("C", Matrix(Matrix::Identity(order, order)));
  return model;
}

/// Agent 1 for forty rounds in which it hears nobody; its plant, if there is one, is elsewhere in every round.
void expect_unmoved(Protocol& protocol, std::size_t measured, const std::string& what) {
  std::vector<double> y(measured), before(protocol.estimate_layout().size()), after(before.size()), u(protocol.control_size());
  protocol.estimate(before);
  for (Round k = 0; k < 40; ++k) {
    for (std::size_t i = 0; i < y.size(); ++i) y[i] = std::sin(0.7 * k + static_cast<double>(i)) * 5.0;
    protocol.absorb(Sense{.k = k, .dt = 0.05, .in_neighbours = {}, .out_degree = 2, .y = y, .self = AgentId{1}}, {});
    protocol.control(u);
    for (const double component : u) ASSERT_EQ(component, 0.0) << what << ", round " << k;
  }
  if (measured > 0) return;  // what it says of itself is what it measures, or its gains
  protocol.estimate(after);
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(after[i], before[i], 1e-14 * std::abs(before[i])) << what;
}

TEST(Leader, IsMovedByNothingWhateverTheProtocolAndItsValues) {
  for (const ProtocolEntry& entry : protocol_table()) {
    if (entry.truth != Truth::none || entry.name == "acyclic_sensing") continue;  // they find something out, and nobody leads
    std::size_t made = 0;
    for (const std::size_t choice : {0U, 1U, 2U})
      for (const Eigen::Index n : {0, 1, 2, 3}) {  // 0: no plant
        const Values parameters = unusual(entry.parameters, std::max<Eigen::Index>(n, 1), choice);
        const Values initial = unusual(entry.initial, std::max<Eigen::Index>(n, 1), choice), model = n > 0 ? integrators(n) : Values{};
        const auto measured = static_cast<std::size_t>(n);
        std::unique_ptr<Protocol> protocol;
        try {
          if (n == 0 && entry.needs_plant) continue;
          protocol = entry.make(parameters, consort::Setup{AgentId{1}, 3, 0.05, initial, model, measured});
        } catch (const ConfigError&) {
          continue;  // it wants another plant
        }
        const bool steers = protocol->control_size() > 0;
        if (n > 0 && !steers) continue;
        expect_unmoved(*protocol, measured, std::string(entry.name) + " with a plant of order " + std::to_string(n));
        ++made;
      }
    EXPECT_GE(made, 3U) << entry.name << ": was tried with no plant";
  }
}

}  // namespace
}  // namespace consort
