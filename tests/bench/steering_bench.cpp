// One round of one agent with two in-neighbours (emit, absorb, control or estimate) for continuous Kalman, static, minimum-energy and
// measured consensus and for local voting with a plant, beside a bare Eigen loop that does the same arithmetic on the same messages.

#include "agent/registry.hpp"

#include <benchmark/benchmark.h>

#include <array>

namespace consort {
namespace {

constexpr Seconds kDt = 1e-3;
constexpr double kRoot3 = 1.7320508075688772;

/// What protocol and bare loop both start from. Messages are (2, ..) and (-1, ..), so that nothing is zero.
struct Scene {
  std::vector<Neighbour> neighbours{{AgentId{2}, 1.0}, {AgentId{3}, 1.0}};
  std::vector<double> y;
  std::array<std::vector<double>, 2> heard;
};
Scene scene_of(std::size_t measurement, std::size_t message) {
  Scene scene{.y = std::vector<double>(measurement, 0.5), .heard = {}};
  scene.heard = {std::vector<double>(message, 2.0), std::vector<double>(message, 1.0)};
  return scene;
}

Values model_of(const char* name, std::size_t measurement) {
  Values model;
  if (std::string_view(name) == "static_consensus") {
    model.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished());
    model.set("B", (Matrix(2, 1) << 0, 1).finished());
    model.set("C", Matrix(Matrix::Identity(2, 2)));
  } else if (measurement == 3) {
    model.set("sensed", Matrix((Vector(3) << 1, 2, 3).finished()));
  }
  return model;
}

void run_protocol(benchmark::State& state, const char* name, std::size_t measurement) {
  Values parameters, initial;
  if (std::string_view(name) == "static_consensus") parameters.set("c", 1.0);
  if (measurement == 0 || measurement == 3) initial.set("x", 0.5);
  if (measurement == 0) parameters.set("Omega", 0.1);
  const Values model = model_of(name, measurement);
  const auto protocol = find_protocol(name).make(parameters, Setup{AgentId{1}, 3, kDt, initial, model, measurement});
  const Scene scene = scene_of(measurement, protocol->message_layout().size());
  const std::array<Received, 2> inbox{Received{AgentId{2}, 0, 1.0, scene.heard[0]}, Received{AgentId{3}, 0, 1.0, scene.heard[1]}};
  std::vector<double> payload(protocol->message_layout().size()), u(protocol->control_size());
  Round k = 0;
  for (auto _ : state) {
    const Sense sense{k++, kDt, scene.neighbours, 2, scene.y, AgentId{1}};
    protocol->emit(sense, payload);
    protocol->absorb(sense, inbox);
    protocol->control(u);
    benchmark::DoNotOptimize(payload.data());
    benchmark::DoNotOptimize(u.data());
  }
}

using Numbers = Eigen::Map<const Vector>;

/// `round(scene, own)` is one round's arithmetic with vectors sized at run time, as the protocol's are; `own` is the agent's state.
template <class RoundOf>
void run_bare(benchmark::State& state, std::size_t measurement, std::size_t message, RoundOf round) {
  Scene scene = scene_of(measurement, message);
  Vector own = Vector::Constant(2, 0.5), out = Vector::Zero(2);
  for (auto _ : state) {
    for (auto& heard : scene.heard) benchmark::DoNotOptimize(heard.data());
    benchmark::DoNotOptimize(scene.y.data());
    round(scene, own, out);
    benchmark::DoNotOptimize(out.data());
    benchmark::DoNotOptimize(own.data());
  }
}

void voting(const Scene& s, Vector& x, Vector& u) {
  x = Numbers(s.y.data(), 1);
  u = Vector::Zero(1);
  for (const auto& heard : s.heard) u += Numbers(heard.data(), 1) - x;
}

void static_gain(const Scene& s, Vector& x, Vector& u) {
  static const Matrix gain = (Matrix(1, 2) << 1, kRoot3).finished();
  x = Numbers(s.y.data(), 2);
  Vector disagreement = Vector::Zero(2);
  for (const auto& heard : s.heard) disagreement += Numbers(heard.data(), 2) - x;
  u = gain * disagreement;
}

void measured(const Scene& s, Vector& x, Vector& u) {
  x = Numbers(s.y.data(), 1);
  u = Vector::Zero(1);
  for (int j = 1; j < 3; ++j) u += Numbers(s.y.data() + j, 1) - x;
}

void filtered(const Scene& s, Vector& x, Vector& u) {
  const double Q = 1.0 / std::sqrt(1.0 + 2.0 / 2.0);
  Vector surprise = Vector::Zero(1);
  for (int j = 1; j < 3; ++j) surprise += Numbers(s.y.data() + j, 1) - x.head(1);
  u = 0.5 * surprise;
  x = (x.head(1) + kDt * (u + Q * (Numbers(s.y.data(), 1) - x.head(1) + 0.5 * surprise))).eval();
}

void kalman(const Scene& s, Vector& own, Vector&) {
  double certainty = 0.0, pull = 0.0;
  for (const auto& heard : s.heard) {
    const double of_j = 1.0 / (heard[1] + 0.1);
    certainty += of_j;
    pull += of_j * (heard[0] - own[0]);
  }
  double x = 0.0, P = own[1];
  const auto slope = [&](double at_x, double at_P) { return std::array{at_P * (pull - certainty * at_x), -at_P * certainty * at_P}; };
  const auto k1 = slope(x, P), k2 = slope(x + kDt / 2 * k1[0], P + kDt / 2 * k1[1]), k3 = slope(x + kDt / 2 * k2[0], P + kDt / 2 * k2[1]),
             k4 = slope(x + kDt * k3[0], P + kDt * k3[1]);
  own[0] += kDt / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]);
  own[1] += kDt / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1]);
}

void add(const char* name, std::size_t measurement, std::size_t message, void (*bare)(const Scene&, Vector&, Vector&)) {
  const std::string text = name;
  benchmark::RegisterBenchmark(("Protocol/" + text).c_str(), [=](benchmark::State& state) { run_protocol(state, name, measurement); });
  benchmark::RegisterBenchmark(("Bare/" + text).c_str(), [=](benchmark::State& state) { run_bare(state, measurement, message, bare); });
}

}  // namespace
}  // namespace consort

int main(int argc, char** argv) {
  consort::add("local_voting", 1, 1, consort::voting);
  consort::add("static_consensus", 2, 2, consort::static_gain);
  consort::add("measured_consensus", 3, 1, consort::measured);
  consort::add("minimum_energy_consensus", 3, 1, consort::filtered);
  consort::add("continuous_kalman_consensus", 0, 2, consort::kalman);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
