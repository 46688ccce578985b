/// The bench: every speed figure beside its raw twin, measured in turns on the same machine. Prints a table, writes bench.json. Never a
/// pass or fail.

#include "tests/bench/command.hpp"
#include "tests/bench/ddsperf.hpp"
#include "tests/bench/figures.hpp"

#include <CLI/CLI.hpp>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>

namespace consort::bench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Options {
  fs::path consort, programs, experiments, output = "bench.json";
  std::vector<std::string> only;
  bool quick = false;
  int turns() const { return quick ? 1 : 3; }
  double seconds() const { return quick ? 1.0 : 3.0; }
};

const std::vector<std::string> kNames{"ring_10",
                                      "ring_50",
                                      "ring_100",
                                      "complete_10",
                                      "complete_50",
                                      "complete_100",
                                      "hosted_ring_100_in_2",
                                      "hosted_ring_1000_in_4",
                                      "closed_loop_10",
                                      "closed_loop_50",
                                      "closed_loop_100",
                                      "localization_6",
                                      "beam_6",
                                      "observer_10",
                                      "observer_50",
                                      "observer_100",
                                      "startup_ring_10",
                                      "startup_ring_100",
                                      "startup_ring_1000",
                                      "memory_ring_100",
                                      "realtime_10_at_1khz",
                                      "realtime_100_at_100hz",
                                      "realtime_most_agents_at_100hz",
                                      "realtime_highest_rate_of_10",
                                      "simulate",
                                      "protocols"};

/// Lockstep rounds of one shape and size, with the raw twin's options.
struct Exchange {
  std::string name, shape;
  int agents, agents_per_process;
  std::vector<std::string> raw_options;
  Aim aim;
  int short_rounds;    ///< enough to start and to tell the rate roughly
  bool plant = false;  ///< the agents steer a plant: beside the raw ring, which has none of its two samples per agent and round
};

const std::vector<Exchange>& exchanges() {
  using Of = Aim::Of;
  static const std::vector<Exchange> list{
      {"ring_10", "ring", 10, 1, {}, {Of::ratio_at_least, 0.8}, 500},
      {"ring_50", "ring", 50, 1, {}, {Of::ratio_at_least, 0.8}, 100},
      {"ring_100", "ring", 100, 1, {}, {Of::ratio_at_least, 0.8}, 50},
      {"complete_10", "complete", 10, 1, {"--multicast"}, {Of::ratio_at_least, 0.8}, 200},
      {"complete_50", "complete", 50, 1, {"--multicast"}, {Of::ratio_at_least, 0.8}, 20},
      {"hosted_ring_100_in_2", "ring", 100, 50, {}, {Of::ratio_at_least, 0.5}, 1000},
      {"hosted_ring_1000_in_4", "ring", 1000, 250, {}, {Of::value_at_least, 2500}, 200},
      {"closed_loop_10", "ring", 10, 1, {}, {}, 300, true},
      {"closed_loop_50", "ring", 50, 1, {}, {}, 50, true},
      {"closed_loop_100", "ring", 100, 1, {}, {}, 30, true},
  };
  return list;
}

/// Estimators, beside the raw exchange of eight numbers on a ring as large: theirs is longer, and they wait for a plant.
struct Estimator {
  std::string name, experiment;  ///< a shipped experiment; empty: everybody observes everybody on a ring of two-state agents
  int agents;
  long rounds;
};

const std::vector<Estimator>& estimators() {
  static const std::vector<Estimator> list{{"localization_6", "localization_single.yaml", 6, 10'000},
                                           {"beam_6", "beam.yaml", 6, 5'000},
                                           {"observer_10", "", 10, 2'000},
                                           {"observer_50", "", 50, 200},
                                           {"observer_100", "", 100, 60}};
  return list;
}

/// A ring whose rounds a clock paces: so many processes, so many rounds per second.
struct Clocked {
  std::string name;
  int agents;
  double rate;
};

const std::vector<Clocked>& clocked() {
  static const std::vector<Clocked> list{{"realtime_10_at_1khz", 10, 1000.0}, {"realtime_100_at_100hz", 100, 100.0}};
  return list;
}

/// Harder and harder for the clock, until messages are late: where is the knee?
struct Ladder {
  std::string name, unit;
  std::vector<Clocked> steps;  ///< named by what is counted
  double aim;
};

const std::vector<Ladder>& ladders() {
  static const auto steps = [](std::initializer_list<int> agents, std::initializer_list<int> rates) {
    std::vector<Clocked> list;
    for (const int n : agents)
      for (const int rate : rates) list.push_back({std::to_string(agents.size() > 1 ? n : rate), n, static_cast<double>(rate)});
    return list;
  };
  static const std::vector<Ladder> list{{"realtime_most_agents_at_100hz", "agents", steps({25, 50, 100, 150, 200, 300}, {100}), 100.0},
                                        {"realtime_highest_rate_of_10", "rounds/s", steps({10}, {500, 1000, 2000, 5000, 10000}), 1000.0}};
  return list;
}

class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string pattern = (fs::temp_directory_path() / "consort-bench-XXXXXX").string();
    if (mkdtemp(pattern.data()) == nullptr) throw std::system_error(errno, std::generic_category(), pattern);
    path_ = pattern;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// One run of Consort; `ran` is false when it did not come to its end.
struct Ours {
  bool ran = false;
  double startup = 0.0, rate = 0.0, delivered = 0.0, cpu = 0.0;
};

/// One run of a ring that a clock paces, Consort's or the raw program's.
struct Kept {
  double late = 0.0;                ///< %, of all messages: not there when their round was over, late, lost or never sent
  double jitter_p99 = 0.0;          ///< us, wake-ups after the planned instant; of the process where it is largest
  double cpu = 0.0, arrived = 0.0;  ///< s, of all processes, and the messages that came at all
};

/// The figures of several such runs; what starting and ending cost is taken off.
struct KeptTurns {
  std::vector<double> late, jitter_p99, cpu_per_message, cores;
  void add(const Kept& run, const Kept& start, double seconds) {
    late.push_back(run.late);
    jitter_p99.push_back(run.jitter_p99);
    cores.push_back((run.cpu - start.cpu) / seconds);
    if (run.arrived > start.arrived) cpu_per_message.push_back(1e6 * (run.cpu - start.cpu) / (run.arrived - start.arrived));
  }
};

class Bench {
 public:
  explicit Bench(const Options& options) : options_(options) {}

  void run() {
    for (const Exchange& exchange : exchanges())
      if (wanted(exchange.name)) measure(exchange);
    if (wanted("complete_100")) measure_complete_100();
    for (const Estimator& estimator : estimators())
      if (wanted(estimator.name)) measure(estimator);
    for (const auto& [agents, limit] : std::map<int, double>{{10, 1.0}, {100, 3.0}, {1000, 12.0}})
      if (wanted(fmt::format("startup_ring_{}", agents))) measure_startup(agents, limit);
    if (wanted("memory_ring_100")) measure_memory();
    for (const Clocked& ring : clocked())
      if (wanted(ring.name)) measure(ring);
    for (const Ladder& ladder : ladders())
      if (wanted(ladder.name)) measure(ladder);
    if (wanted("simulate")) measure_simulation();
    if (wanted("protocols")) measure_protocols();
  }
  const std::vector<Figure>& figures() const { return figures_; }

 private:
  bool wanted(const std::string& name) const {
    return options_.only.empty() || std::find(options_.only.begin(), options_.only.end(), name) != options_.only.end();
  }

  static void say(const std::string& what) { fmt::print(stderr, "bench: {}\n", what); }

  // --- the two sides ----------------------------------------------------------------------------------------------------

  std::optional<json> raw(const std::string& program, const Exchange& exchange, const std::vector<std::string>& more,
                          double seconds) const {
    std::vector<std::string> command{
        (options_.programs / program).string(),      exchange.shape, std::to_string(exchange.agents), "--agents-per-process",
        std::to_string(exchange.agents_per_process), "--seconds",    std::to_string(seconds)};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome outcome = run_command(command, 200.0);
    if (outcome.exit_code != 0) return std::nullopt;
    return json::parse(outcome.output);
  }

  /// summary.json of a run that came to its end, and the CPU time of all its processes.
  struct Ended {
    json summary;
    double cpu;
  };

  std::optional<Ended> run_to_end(const fs::path& file, double limit, const std::function<void(pid_t)>& watch = {},
                                  const std::vector<std::string>& more = {}) const {
    const fs::path results = folder_.path() / fmt::format("results-{}", ++runs_);
    std::vector<std::string> command{options_.consort.string(), "run", file.string(), "--json", "--quiet", "--output", results.string()};
    command.insert(command.end(), more.begin(), more.end());
    const Outcome outcome = run_command(command, limit, watch);
    std::error_code ignored;
    fs::remove_all(results, ignored);
    if (outcome.exit_code != 0 && outcome.exit_code != 1) {  // 1: a criterion was not met, but the run came to its end
      say(fmt::format("consort run {} ended with exit code {}", file.filename().string(), outcome.exit_code));
      return std::nullopt;
    }
    return Ended{json::parse(outcome.output), outcome.cpu_seconds};
  }

  Ours run_file(const fs::path& file, double limit, const std::function<void(pid_t)>& watch = {},
                std::vector<std::string> more = {}) const {
    more.insert(more.end(), {"--mode", "lockstep"});
    const auto ended = run_to_end(file, limit, watch, more);
    if (!ended) return {};
    const json& performance = ended->summary.at("performance");
    return {true, performance.at("startup_seconds"), performance.at("rounds_per_second"), performance.at("messages_delivered"), ended->cpu};
  }

  /// local_voting on eight states, or steering integrators of eight coordinates; telemetry at its default.
  Ours ours(const Exchange& exchange, long rounds, const std::function<void(pid_t)>& watch = {}) const {
    const int degree = exchange.shape == "ring" ? 2 : exchange.agents - 1;
    const fs::path file = folder_.path() / (exchange.name + ".yaml");
    std::ofstream(file) << fmt::format(
        "experiment: bench_{0}\n"
        "mode: lockstep\n"
        "seed: 1\n"
        "rounds: {1}\n"
        "dt: {2:.6f}\n"
        "agents:\n"
        "  count: {3}\n"
        "  protocol: local_voting\n"
        "{6}"
        "topology: {4}\n"
        "placement: {{agents_per_process: {5}}}\n"
        "stop: {{deadline: 300 s}}\n",
        exchange.name, rounds, 0.5 / (degree + 1), exchange.agents, exchange.shape, exchange.agents_per_process,
        exchange.plant ? "plant: {model: {name: integrator, dimension: 8}, initial: {position: {uniform: [0, 1], dimension: 8}}}\n"
                       : "  initial: {x: {uniform: [0, 1], dimension: 8}}\n");
    return run_file(file, 330.0, watch);
  }

  static double messages_of(const Clocked& ring, double rounds) { return 2.0 * ring.agents * rounds; }  // everybody hears two

  std::optional<Kept> raw(const Clocked& ring, double seconds) const {
    const auto twin = raw("raw_dds", {ring.name, "ring", ring.agents, 1, {}, {}, 0}, {"--rate", std::to_string(ring.rate)}, seconds);
    if (!twin) return std::nullopt;
    const double in_time = twin->at("messages_in_time"), jitter = twin->at("jitter_p99");
    return Kept{100.0 * (1.0 - in_time / messages_of(ring, twin->at("rounds"))), 1e6 * jitter, twin->at("cpu_seconds"),
                twin->at("messages")};
  }

  /// As the raw program's rounds, through `consort run`; telemetry at its default.
  std::optional<Kept> ours(const Clocked& ring, double seconds) const {
    const long rounds = std::lround(seconds * ring.rate);
    const fs::path file = folder_.path() / fmt::format("realtime-{}-{}.yaml", ring.agents, ring.rate);
    std::ofstream(file) << fmt::format(
        "experiment: bench_realtime\nmode: realtime\nseed: 1\nrounds: {}\ndt: {:.9f}\n"
        "agents: {{count: {}, protocol: local_voting, initial: {{x: {{uniform: [0, 1], dimension: 8}}}}}}\n"
        "topology: ring\nstop: {{deadline: 120 s}}\n",
        rounds, 1.0 / ring.rate, ring.agents);
    const auto ended = run_to_end(file, 150.0);
    if (!ended) return std::nullopt;
    const auto metric = [&](const char* name) { return ended->summary.at("metrics").at(name).get<double>(); };
    const double arrived = metric("network_sent") - metric("network_lost"), in_time = arrived - metric("network_late");
    return Kept{100.0 * (1.0 - in_time / messages_of(ring, static_cast<double>(rounds))), 1e6 * metric("jitter_p99"), ended->cpu, arrived};
  }

  // --- figures ----------------------------------------------------------------------------------------------------------

  void measure(const Exchange& exchange) {
    // A short run tells what starting and ending cost, which is taken off the CPU per message. Its rate is that of the first grants, so a
    // longer one tells how many rounds fill the time: as long as the raw programs are measured, after their warm-up.
    const Ours brief = ours(exchange, exchange.short_rounds);
    const auto rounds_in = [&](const Ours& run, double seconds) {
      return std::max(10L * exchange.short_rounds, std::lround(run.rate * seconds));
    };
    const Ours longer = brief.ran ? ours(exchange, rounds_in(brief, options_.seconds() / 4.0)) : Ours{};
    const long rounds = rounds_in(longer, options_.seconds());
    std::vector<double> raw_rate, raw_cpu, udp_rate, udp_cpu, rate, cpu;
    for (int turn = 1; turn <= options_.turns(); ++turn) {
      say(fmt::format("{}, turn {} of {}: raw DDS, Consort ({} rounds), raw UDP", exchange.name, turn, options_.turns(), rounds));
      if (const auto twin = raw("raw_dds", exchange, exchange.raw_options, options_.seconds())) {
        raw_rate.push_back(twin->at("rounds_per_second"));
        raw_cpu.push_back(twin->at("cpu_us_per_message"));
      }
      if (const Ours run = brief.ran ? ours(exchange, rounds) : Ours{}; run.ran) {
        rate.push_back(run.rate);
        if (run.delivered > brief.delivered) cpu.push_back(1e6 * (run.cpu - brief.cpu) / (run.delivered - brief.delivered));
      }
      if (const auto twin = raw("raw_udp", exchange, exchange.raw_options, options_.seconds())) {
        udp_rate.push_back(twin->at("rounds_per_second"));
        udp_cpu.push_back(twin->at("cpu_us_per_message"));
      }
    }
    figures_.push_back({exchange.name, median(rate), "rounds/s", median(raw_rate), exchange.aim});
    figures_.push_back({exchange.name + ".cpu_per_message", median(cpu), "us", median(raw_cpu), {}});
    figures_.push_back({exchange.name + ".against_udp", median(rate), "rounds/s", median(udp_rate), {}});
    figures_.push_back({exchange.name + ".cpu_per_message_udp", median(cpu), "us", median(udp_cpu), {}});
  }

  /// Rounds by the clock. ddsperf tells the latency of messages, and not how late it wakes up: that is what stands beside our jitter.
  void measure(const Clocked& ring) {
    constexpr double kStart = 0.5;  // s: a short run tells what starting and ending cost
    const double seconds = 2.0 * options_.seconds();
    const auto brief = ours(ring, kStart);
    const auto brief_ddsperf = run_ddsperf(ring.agents, ring.rate, 1);
    KeptTurns raw_turns, turns;
    std::vector<double> ddsperf_cpu, ddsperf_latency;
    for (int turn = 1; turn <= options_.turns(); ++turn) {
      say(fmt::format("{}, turn {} of {}: raw DDS, Consort, ddsperf", ring.name, turn, options_.turns()));
      if (const auto twin = raw(ring, seconds)) raw_turns.add(*twin, {}, seconds);
      if (const auto run = brief ? ours(ring, kStart + seconds) : std::nullopt) turns.add(*run, *brief, seconds);
      const auto tool = brief_ddsperf ? run_ddsperf(ring.agents, ring.rate, 1 + static_cast<int>(seconds)) : std::nullopt;
      if (!tool || tool->messages <= brief_ddsperf->messages) continue;
      ddsperf_cpu.push_back(1e6 * (tool->cpu - brief_ddsperf->cpu) / (tool->messages - brief_ddsperf->messages));
      ddsperf_latency.push_back(tool->latency_p99);
    }
    figures_.push_back({ring.name, median(turns.late), "% late", median(raw_turns.late), {Aim::Of::value_at_most, kLate}});
    figures_.push_back({ring.name + ".jitter_p99", median(turns.jitter_p99), "us", median(raw_turns.jitter_p99), {}});
    figures_.push_back({ring.name + ".cores", median(turns.cores), "cores", median(raw_turns.cores), {}});
    figures_.push_back({ring.name + ".cpu_per_message", median(turns.cpu_per_message), "us", median(raw_turns.cpu_per_message), {}});
    figures_.push_back({ring.name + ".cpu_per_message_ddsperf", median(turns.cpu_per_message), "us", median(ddsperf_cpu), {}});
    figures_.push_back({ring.name + ".jitter_p99_ddsperf_latency", median(turns.jitter_p99), "us", median(ddsperf_latency), {}});
  }

  /// The last step, from the first on, with fewer late messages than kLate. Anything else on the machine makes messages late, so a step
  /// that falls short is tried again. What each step came to goes into `late`. None: not even the first step came to its end.
  std::optional<double> climb(const Ladder& ladder, const std::function<std::optional<Kept>(const Clocked&)>& run,
                              std::map<std::string, double>& late) const {
    double reached = 0.0;
    for (const Clocked& step : ladder.steps) {
      for (int attempt = 1; attempt <= 2; ++attempt) {
        const auto kept = run(step);
        if (!kept) continue;
        const auto known = late.emplace(step.name, kept->late).first;
        known->second = std::min(known->second, kept->late);
        if (kept->late < kLate) break;
      }
      const auto known = late.find(step.name);
      if (known == late.end() || known->second >= kLate) break;
      reached = std::stod(step.name);
    }
    return late.empty() ? std::nullopt : std::optional(reached);
  }

  void measure(const Ladder& whole) {
    say(fmt::format("{}: raw DDS, then Consort, up to the first step where {:g} % of the messages are late", whole.name, kLate));
    Ladder ladder = whole;
    if (options_.quick) ladder.steps = {whole.steps[1], whole.steps[2]};
    std::map<std::string, double> raw_late, late;
    const auto raw_reached = climb(
        ladder, [&](const Clocked& step) { return raw(step, 3.0); }, raw_late);
    const auto reached = climb(
        ladder, [&](const Clocked& step) { return ours(step, 3.0); }, late);
    figures_.push_back({ladder.name, reached, ladder.unit, raw_reached, {Aim::Of::value_at_least, ladder.aim}});
    for (const Clocked& step : ladder.steps) {
      const auto of = [&](const auto& known) { return known.contains(step.name) ? std::optional(known.at(step.name)) : std::nullopt; };
      if (of(late)) figures_.push_back({fmt::format("{}.at_{}", ladder.name, step.name), of(late), "% late", of(raw_late), {}});
    }
  }

  void measure_complete_100() {
    say("complete_100: raw DDS, then experiments/complete_100.yaml to its end");
    const Exchange twin{"complete_100", "complete", 100, 1, {"--multicast", "--tuned"}, {}, 0};
    const auto bare = raw("raw_dds", twin, twin.raw_options, 2.0 * options_.seconds());
    const Ours run = run_file(options_.experiments / "complete_100.yaml", 600.0);
    const auto of_raw = [&](const char* key) { return bare ? std::optional<double>(bare->at(key)) : std::nullopt; };
    figures_.push_back({"complete_100.came_to_its_end", run.ran ? 1.0 : 0.0, "runs", std::nullopt, {Aim::Of::value_at_least, 1}});
    figures_.push_back({"complete_100", run.ran ? std::optional(run.rate) : std::nullopt, "rounds/s", of_raw("rounds_per_second"), {}});
    figures_.push_back({"complete_100.startup", run.ran ? std::optional(run.startup) : std::nullopt, "s", of_raw("startup_seconds"), {}});
  }

  void measure(const Estimator& estimator) {
    fs::path file = options_.experiments / estimator.experiment;
    if (estimator.experiment.empty()) {
      file = folder_.path() / (estimator.name + ".yaml");
      std::ofstream(file) << fmt::format(
          "experiment: bench_{}\nmode: lockstep\nseed: 1\nrounds: {}\ndt: 0.01\n"
          "agents: {{count: {}, protocol: {{name: distributed_observer, mu: 10, F: [[1, 0], [0, 1]]}}}}\ntopology: ring\n"
          "plant: {{model: {{name: linear, A: [[0, 1], [-1, -0.1]]}}, initial: {{x: {{uniform: [-1, 1], dimension: 2}}}}}}\n"
          "stop: {{deadline: 300 s}}\n",
          estimator.name, estimator.rounds, estimator.agents);
    }
    const Exchange twin{estimator.name, "ring", estimator.agents, 1, {}, {}, 0};
    std::vector<double> raw_rate, rate;
    for (int turn = 1; turn <= options_.turns(); ++turn) {
      say(fmt::format("{}, turn {} of {}: raw DDS, Consort ({} rounds)", estimator.name, turn, options_.turns(), estimator.rounds));
      if (const auto bare = raw("raw_dds", twin, {}, options_.seconds())) raw_rate.push_back(bare->at("rounds_per_second"));
      if (const Ours run = run_file(file, 330.0, {}, {"--rounds", std::to_string(estimator.rounds)}); run.ran) rate.push_back(run.rate);
    }
    figures_.push_back({estimator.name, median(rate), "rounds/s", median(raw_rate), {}});
  }

  void measure_startup(int agents, double limit) {
    const Exchange exchange{fmt::format("startup_ring_{}", agents), "ring", agents, 1, {}, {}, 0};
    std::vector<double> raw_startup, startup;
    for (int turn = 1; turn <= options_.turns(); ++turn) {
      say(fmt::format("{}, turn {} of {}: raw DDS, Consort", exchange.name, turn, options_.turns()));
      if (const auto twin = raw("raw_dds", exchange, {}, 0.2)) raw_startup.push_back(twin->at("startup_seconds"));
      if (const Ours run = ours(exchange, 20); run.ran) startup.push_back(run.startup);
    }
    figures_.push_back({exchange.name, median(startup), "s", median(raw_startup), {Aim::Of::value_at_most, limit}});
  }

  /// Mean proportional set size of the agent processes that descend from `root`, MB; none when not all are there.
  static std::optional<double> agent_memory(pid_t root, std::size_t agents) {
    std::map<pid_t, pid_t> parent_of;
    std::vector<pid_t> found;
    for (const auto& entry : fs::directory_iterator("/proc")) {
      std::ifstream file(entry.path() / "stat");
      pid_t pid = 0, parent = 0;
      std::string name, state;
      if (!(file >> pid >> name >> state >> parent)) continue;
      parent_of[pid] = parent;
      if (name == "(consort-agent)") found.push_back(pid);
    }
    double kilobytes = 0.0;
    std::size_t counted = 0;
    for (const pid_t pid : found) {
      pid_t ancestor = pid;
      while (ancestor > 1 && ancestor != root) ancestor = parent_of.contains(ancestor) ? parent_of[ancestor] : 0;
      if (ancestor != root) continue;
      std::ifstream file(fmt::format("/proc/{}/smaps_rollup", pid));
      double value = 0.0;
      for (std::string word; file >> word;)
        if (word == "Pss:" && file >> value) break;
      if (value == 0.0) continue;
      kilobytes += value;
      ++counted;
    }
    if (counted != agents) return std::nullopt;
    return kilobytes / 1024.0 / static_cast<double>(counted);
  }

  void measure_memory() {
    say("memory_ring_100: raw DDS, Consort");
    const Exchange exchange{"memory_ring_100", "ring", 100, 1, {}, {}, 50};
    const auto twin = raw("raw_dds", exchange, {}, options_.seconds());
    const Ours brief = ours(exchange, exchange.short_rounds);
    std::optional<double> largest;
    const auto watch = [&](pid_t pid) {
      if (const auto memory = agent_memory(pid, 100)) largest = std::max(largest.value_or(0.0), *memory);
    };
    if (brief.ran) ours(exchange, std::max(500L, std::lround(brief.rate * 2.0 * options_.seconds())), watch);
    const auto bare = twin ? std::optional<double>(twin->at("pss_mb_per_process")) : std::nullopt;
    figures_.push_back({exchange.name, largest, "MB", bare, {Aim::Of::value_at_most, 3.0}});
  }

  /// simulate() against a bare loop with the same arithmetic.
  void measure_simulation() {
    const std::map<std::string, Aim> aims{{"kalman_pairs_10", {Aim::Of::ratio_at_least, 0.15}},
                                          {"kalman_complete_100", {Aim::Of::ratio_at_least, 0.05}}};
    measure_pairs("simulate", "simulate_bench", "Simulate/", [&](const std::string& example) {
      const auto aim = aims.find(example);
      return aim != aims.end() ? aim->second : Aim{};
    });
  }

  /// One agent's round, per protocol, against a bare loop with the same arithmetic.
  void measure_protocols() {
    measure_pairs("protocols", "protocol_bench", "Protocol/", [](const std::string&) { return Aim{Aim::Of::ratio_at_least, 0.5}; });
  }

  /// A program of benchmarks that come in pairs, `ours`<case> and Bare/<case>: a figure per pair, the median of the turns.
  void measure_pairs(const std::string& name, const char* program, const std::string& ours,
                     const std::function<Aim(const std::string&)>& aim) {
    say(fmt::format("{}: against bare loops", name));
    const Outcome outcome =
        run_command({(options_.programs / program).string(), "--benchmark_format=json",
                     fmt::format("--benchmark_repetitions={}", options_.turns()), "--benchmark_enable_random_interleaving=true"},
                    300.0);
    if (outcome.exit_code != 0) {
      figures_.push_back({name, std::nullopt, "rounds/s", std::nullopt, {}});
      return;
    }
    std::map<std::string, std::vector<double>> rates;
    const json report = json::parse(outcome.output);
    for (const json& benchmark : report.at("benchmarks"))
      if (benchmark.at("run_type") == "iteration") rates[benchmark.at("run_name")].push_back(benchmark.at("rounds_per_second"));
    for (const auto& [of_pair, rate] : rates) {
      if (!of_pair.starts_with(ours)) continue;
      const std::string example = of_pair.substr(ours.size());
      const auto bare = rates.find("Bare/" + example);
      figures_.push_back(
          {name + "_" + example, median(rate), "rounds/s", bare != rates.end() ? median(bare->second) : std::nullopt, aim(example)});
    }
  }

  static constexpr double kLate = 1.0;  ///< %, of the messages: what a clock's rounds may lack

  Options options_;
  TemporaryFolder folder_;
  mutable int runs_ = 0;
  std::vector<Figure> figures_;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--consort", options.consort, "the consort executable")->check(CLI::ExistingFile)->required();
  app.add_option("--programs", options.programs, "folder of raw_dds, raw_udp and the other benches; default: that of this program");
  app.add_option("--experiments", options.experiments, "folder of complete_100.yaml")->check(CLI::ExistingDirectory)->required();
  app.add_option("--output", options.output, "where the figures go as JSON")->capture_default_str();
  app.add_option("--only", options.only, "only this figure; may be repeated")->check(CLI::IsMember(kNames));
  app.add_flag("--quick", options.quick, "one short turn instead of the median of three");
}

}  // namespace
}  // namespace consort::bench

int main(int argc, char** argv) {
  using namespace consort::bench;
  CLI::App app{
      "Measures Consort beside raw programs, in turns on this machine. A figure that falls short is printed as it is, marked short.\n"
      "Example: consort-bench --consort build/release/bin/consort --experiments experiments --quick --only ring_10"};
  Options options;
  add_options(app, options);
  CLI11_PARSE(app, argc, argv);
  if (options.programs.empty()) options.programs = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  try {
    Bench bench(options);
    bench.run();
    fmt::print("{}", table(bench.figures()));
    std::ofstream(options.output) << as_json(bench.figures()).dump(2) << '\n';
    fmt::print("figures written to {}\n", options.output.string());
  } catch (const std::exception& error) {
    fmt::print(stderr, "consort-bench: {}\n", error.what());
    return 3;
  }
  return 0;
}
