// One round of one agent with two in-neighbours (emit, absorb, control), beside a bare Eigen loop that does the same arithmetic on the same
// messages.

#include "agent/registry.hpp"

#include <benchmark/benchmark.h>

#include <array>
#include <cmath>

namespace consort {
namespace {

constexpr Seconds kDt = 1e-3;
constexpr double kRoot3 = 1.7320508075688772;

struct Scene {
  Matrix A = (Matrix(2, 2) << 0, 1, 0, 0).finished(), B = (Matrix(2, 1) << 0, 1).finished();
  Matrix K = (Matrix(1, 2) << 1, kRoot3).finished(), P = (Matrix(2, 2) << kRoot3, 1, 1, kRoot3).finished();
  std::vector<Neighbour> neighbours{{AgentId{2}, 1.0}, {AgentId{3}, 1.0}};
  std::vector<Vector> heard{Vector::Constant(2, 1e-3), Vector::Constant(2, -1e-3)};
  Vector y = Vector::Zero(2);
};

void run_protocol(benchmark::State& state, const char* name, std::size_t measurement) {
  const Scene scene;
  Values parameters, initial, model;
  model.set("A", scene.A);
  model.set("B", scene.B);
  model.set("C", Matrix(Matrix::Identity(2, 2)));
  const auto protocol = make_protocol(find_protocol(name), parameters, Setup{AgentId{1}, 3, kDt, initial, model, measurement}, 1);
  const std::size_t size = protocol->message_layout().size();
  std::vector<double> payload(size), first(size), second(size), y(measurement, 0.0);
  for (std::size_t c = 0; c < measurement; ++c) {
    first[c] = 1e-3;
    second[c] = -1e-3;
  }
  const std::array<Received, 2> inbox{Received{AgentId{2}, 0, 1.0, first}, Received{AgentId{3}, 0, 1.0, second}};
  Round k = 0;
  double u = 0.0;
  for (auto _ : state) {
    const Sense sense{k++, kDt, scene.neighbours, 2, y, AgentId{1}};
    protocol->emit(sense, payload);
    protocol->absorb(sense, inbox);
    protocol->control(std::span(&u, 1));
    benchmark::DoNotOptimize(u);
    benchmark::DoNotOptimize(payload.data());
  }
}

/// `round(scene, c)` is one round's arithmetic; it returns u.
template <class RoundOf>
void run_bare(benchmark::State& state, RoundOf&& round) {
  Scene scene;
  Vector message = Vector::Zero(2);
  std::array<double, 3> gains{1.0, 1.0, 1.0};
  for (auto _ : state) {
    benchmark::DoNotOptimize(scene.heard[0].data());
    benchmark::DoNotOptimize(scene.heard[1].data());
    message = scene.y;
    double u = round(scene, gains);
    benchmark::DoNotOptimize(u);
    benchmark::DoNotOptimize(message.data());
  }
}

double adaptive(const Scene& s, std::array<double, 3>& c) {
  static const double decayed = -std::expm1(-0.33 * kDt) / 0.33;
  Vector pull = Vector::Zero(2);
  double disagreement = 0.0;
  for (const Vector& heard : s.heard) {
    const Vector difference = heard - s.y;
    pull += difference;
    disagreement += s.K.lazyProduct(difference).squaredNorm();
  }
  const double u = c[0] * s.K.lazyProduct(pull)(0, 0);
  c[0] += decayed * (disagreement - 0.33 * (c[0] - 0.01));
  return u;
}

double li_edges(const Scene& s, std::array<double, 3>& c) {
  Vector pull = Vector::Zero(2);
  for (std::size_t j = 0; j < 2; ++j) {
    const Vector difference = s.heard[j] - s.y;
    pull += c[j] * difference;
    c[j] += kDt * s.K.lazyProduct(difference).squaredNorm();
  }
  return s.K.lazyProduct(pull)(0, 0);
}

double li_agents(const Scene& s, std::array<double, 3>& c) {
  Vector xi = Vector::Zero(2);
  for (const Vector& heard : s.heard) xi += s.y - heard;
  const double root = 1.0 + xi.dot(s.P.lazyProduct(xi));
  const double u = -c[0] * root * root * root * s.K.lazyProduct(xi)(0, 0);
  c[0] += kDt * s.K.lazyProduct(xi).squaredNorm();
  return u;
}

double yu(const Scene& s, std::array<double, 3>& c) {
  Vector e = Vector::Zero(2);
  for (const Vector& heard : s.heard) e += s.y - heard;
  const double u = -c[0] * (e[0] + e[1]);
  c[0] += kDt * 0.1 * (e[0] * e[0] + e[1] * e[1] + 2.0 * e[0] * e[1]);
  return u;
}

double su(const Scene& s, std::array<double, 3>& c) {
  double u = 0.0;
  for (std::size_t j = 0; j < 2; ++j) {
    const Vector difference = s.y - s.heard[j];
    u -= difference[0] + c[j] * difference[1];
    c[j] += kDt * difference[1] * difference[1];
  }
  return u;
}

double das(const Scene& s, std::array<double, 3>& W) {
  static const double kept = std::exp(-0.1 * kDt), learnt = -std::expm1(-0.1 * kDt) / 0.1;
  Eigen::Map<Eigen::Vector3d> weights(W.data());
  const double x = s.y[0], e = s.heard[0][0] - x + s.heard[1][0] - x;
  const Eigen::Vector3d phi(1.0, std::sin(x), std::cos(x));
  const double u = 20.0 * e - weights.dot(phi);
  weights = kept * weights - (learnt * 10.0 * e * 2.0) * phi;
  return u;
}

void add(const char* name, std::size_t measurement, double (*bare)(const Scene&, std::array<double, 3>&)) {
  const std::string text = name;
  benchmark::RegisterBenchmark(("Protocol/" + text).c_str(), [=](benchmark::State& state) { run_protocol(state, name, measurement); });
  benchmark::RegisterBenchmark(("Bare/" + text).c_str(), [=](benchmark::State& state) { run_bare(state, bare); });
}

void add_all() {
  add("adaptive_consensus", 2, adaptive);
  add("li_edge_consensus", 2, li_edges);
  add("li_agent_consensus", 2, li_agents);
  add("yu_consensus", 2, yu);
  add("su_consensus", 2, su);
  add("das_neural_consensus", 1, das);
}

}  // namespace
}  // namespace consort

int main(int argc, char** argv) {
  consort::add_all();
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
}
