// One round of one agent with two in-neighbours, per protocol: emit, absorb, control, estimate. Beside it a bare Eigen loop that does the
// same arithmetic and what the contract asks for: it reads measurement, weights and messages where they arrive, writes message, control and
// estimate where they are wanted, and looks whether they are finite. It allocates nothing; sizes are known to its compiler where they are
// to the protocol's.

#include "protocols/registry.hpp"
#include "tests/bench/bare_protocols.hpp"

#include <benchmark/benchmark.h>

namespace consort {
namespace {

constexpr Seconds kDt = bare::kStep;
constexpr std::size_t kDimension = 2;

/// What an agent knows when it starts. It knows everything that any protocol wants to know.
struct Start {
  Values parameters, initial, model;
  std::size_t measurement = kDimension;  ///< numbers in y_i

  Start& with(const char* name, double value) {
    parameters.set(name, value);
    return *this;
  }
};

/// A double integrator that is measured whole.
Start steering() {
  Start start;
  start.model.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished());
  start.model.set("B", (Matrix(2, 1) << 0, 1).finished());
  start.model.set("C", Matrix(Matrix::Identity(2, 2)));
  return start;
}

/// Measures itself and both in-neighbours.
Start sensing_neighbours() {
  Start start;
  start.model.set("sensed", Matrix((Vector(3) << 1, 2, 3).finished()));
  start.initial.set("x", Matrix(Vector::Constant(kDimension, 0.5)));
  start.measurement = 3 * kDimension;
  return start;
}

Start without_plant() {
  Start start;
  start.initial.set("x", Matrix(Vector::Constant(kDimension, 0.5)));
  start.measurement = 0;
  return start;
}

Start with_covariances() { return without_plant().with("Q", 0.1).with("Omega", 0.1); }

/// The agent's surroundings in a round, and where its numbers go. Differences are small and cancel, so that nothing grows however long it
/// is measured.
struct Scene {
  Scene(const Layout& message, std::size_t controls, std::size_t estimates, std::size_t measurement)
      : y(measurement, 0.5),
        payload(message.size()),
        u(controls),
        estimate(estimates),
        steered_(std::min(measurement, kDimension) - controls),
        runs_up_(message.fields[0].name == "Y_sum") {
    for (std::size_t j = 0; j < 2; ++j) {
      heard[j].assign(message.size(), runs_up_ ? 0.0 : 1.0);
      inbox.push_back({neighbours[j].id, 0, 1.0, heard[j]});
      if (runs_up_) continue;
      for (std::size_t c = 0; c < message.fields[0].size(); ++c) heard[j][c] = j == 0 ? 0.501 : 0.499;
      if (message.fields.size() > 1 && message.fields[1].cols > 1)  // a covariance or its inverse
        for (std::size_t c = 0; c < message.fields[1].size(); ++c) heard[j][kDimension + c] = c % (kDimension + 1) == 0 ? 1.0 : 0.1;
      if (message.fields[message.fields.size() - 1].name == "leads") heard[j].back() = 0.0;
      if (message.fields.size() > 1 && message.fields[1].name == "changed") heard[j][message.fields[0].size()] = 0.0;
    }
  }
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;
  std::vector<Neighbour> neighbours{{AgentId{2}, 1.0}, {AgentId{3}, 1.0}};
  std::array<std::vector<double>, 2> heard;
  std::vector<Received> inbox;
  std::vector<double> y, payload, u, estimate;

  /// From one round to the next. A plant as small as can be: what u steers moves by it, so that no round begins before the last one has
  /// ended, as in every run. To the compiler all the rest may have changed, too.
  void advance() {
    for (auto* numbers : {&heard[0], &heard[1], &y, &payload, &u, &estimate}) benchmark::DoNotOptimize(numbers->data());
    benchmark::DoNotOptimize(inbox.data());
    benchmark::ClobberMemory();
    for (std::size_t c = 0; c < u.size(); ++c) y[steered_ + c] += kDt * u[c];
    for (std::size_t j = 0; runs_up_ && j < 2; ++j) {
      ++inbox[j].sent;
      for (const std::size_t diagonal : {0, 3}) heard[j][diagonal] += 1.0 / 3.0;
      for (const std::size_t c : {4, 5}) heard[j][c] += 1.0 / 6.0;
    }
  }

 private:
  std::size_t steered_;  // where in y that begins which u moves: at the end of the agent's own part
  bool runs_up_;         // running sums are heard: what everybody holds stays what it was
};

void count_rounds(benchmark::State& state) {
  state.counters["rounds_per_second"] = benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

std::unique_ptr<Protocol> make(const char* name, const Start& start) {
  return find_protocol(name).make(start.parameters, Setup{AgentId{1}, 3, kDt, start.initial, start.model, start.measurement});
}
Scene scene_of(const Protocol& protocol, const Start& start) {
  return {protocol.message_layout(), protocol.control_size(), protocol.estimate_layout().size(), start.measurement};
}

void run_protocol(benchmark::State& state, const char* name, const Start& start) {
  const auto protocol = make(name, start);
  Scene scene = scene_of(*protocol, start);
  Round k = 0;
  for (auto _ : state) {
    const Sense sense{k++, kDt, scene.neighbours, 2, scene.y, AgentId{1}};
    protocol->emit(sense, scene.payload);
    protocol->absorb(sense, scene.inbox);
    protocol->control(scene.u);
    protocol->estimate(scene.estimate);
    scene.advance();
  }
  count_rounds(state);
}

template <class Bare>
void run_bare(benchmark::State& state, const char* name, const Start& start) {
  Scene scene = scene_of(*make(name, start), start);
  Bare bare;
  for (auto _ : state) {
    bare.round({scene.y, scene.neighbours, scene.inbox}, {scene.payload, scene.u, scene.estimate});
    scene.advance();
  }
  count_rounds(state);
}

template <class Bare>
void add(const char* name, const Start& start, const std::string& variant = "") {
  benchmark::RegisterBenchmark(("Protocol/" + (name + variant)).c_str(),
                               [=](benchmark::State& state) { run_protocol(state, name, start); });
  benchmark::RegisterBenchmark(("Bare/" + (name + variant)).c_str(), [=](benchmark::State& state) { run_bare<Bare>(state, name, start); });
}

void add_all() {
  add<bare::LocalVoting>("local_voting", without_plant());
  add<bare::SteeringVoting>("local_voting", steering(), "_with_plant");
  add<bare::Kalman>("kalman_consensus", with_covariances());
  add<bare::ContinuousKalman>("continuous_kalman_consensus", with_covariances());
  add<bare::UnbiasedKalman>("unbiased_kalman_consensus", with_covariances());
  add<bare::UnbiasedInformation>("unbiased_information_consensus", without_plant());
  add<bare::RobustInformation>("robust_information_consensus", without_plant());
  add<bare::Static>("static_consensus", steering().with("c", 1.0));
  add<bare::MinimumEnergy>("minimum_energy_consensus", sensing_neighbours());
  add<bare::Measured>("measured_consensus", sensing_neighbours());
  add<bare::Adaptive>("adaptive_consensus", steering());
  add<bare::Su>("su_consensus", steering());
  add<bare::Yu>("yu_consensus", steering());
  add<bare::LiEdge>("li_edge_consensus", steering());
  add<bare::LiAgent>("li_agent_consensus", steering());
  Start scalar;
  scalar.measurement = 1;
  add<bare::Das>("das_neural_consensus", scalar);
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
