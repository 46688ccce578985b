#pragma once
/// One seed, one experiment: topology, protocol, links, plant and what happens to whom on the way are drawn from it. As a file, so that
/// whoever finds a failure can run it.

#include "core/random.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <string>
#include <vector>

namespace consort::swarm {

struct Case {
  std::string yaml;
  std::string protocol;
  bool conserves = false;  ///< what is averaged stays as much as it was: nothing is lost on the way, nobody comes or goes
  bool agrees = false;     ///< for ever connected, and without anything that keeps the agents apart
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : seed_(seed), draws_(Seed{seed}.stream(Purpose("swarm"))), agents_(2 + draws_.below(9)) {}

  /// With the clock's help: its rounds are 20 ms of real time.
  Case operator()(bool realtime = false) {
    rounds_ = static_cast<unsigned>(60 + draws_.below(140));
    const System system = draw_system();
    std::string out = fmt::format("# Does the run with seed {} keep what must hold?\nexperiment: swarm_{}\nseed: {}\nrounds: {}\ndt: {}\n",
                                  seed_, seed_, seed_, rounds_, realtime ? 0.02 : system.dt);
    if (realtime) out += "mode: realtime\n";
    out += fmt::format("agents:\n  count: {}\n  protocol: {{name: {}{}}}\n", agents_, system.protocol, system.parameters);
    out += system.rest + "topology: " + topology() + "\n";
    const std::string links = link_rules();
    if (!links.empty()) out += "links: {" + links + "}\n";
    const std::string events = process_events() + link_events();
    if (!events.empty()) out += "events:\n" + events;
    if (chance(0.5)) out += fmt::format("telemetry: {{every: {}}}\n", 1 + draws_.below(9));
    if (chance(0.3)) out += fmt::format("placement: {{agents_per_process: {}}}\n", 1 + draws_.below(agents_));
    out += "stop: {deadline: 300 s}\n";
    const bool averages = system.protocol == "local_voting" && system.rest.find("plant:") == std::string::npos;
    return {out, system.protocol, averages && links.empty() && events.empty() && symmetric_,
            averages && events.empty() && always_connected_};
  }

 private:
  struct System {
    std::string protocol, parameters, rest;  ///< of the file: initial values, plant
    double dt;
  };

  System draw_system() {
    switch (draws_.below(5)) {
      case 0:
        return steering();
      case 1:
        return observing_each_other();
      case 2:
        return observing_one_plant();
      default:
        return averaging();
    }
  }

  /// Agents that agree on numbers of their own, or on where they are.
  System averaging() {
    constexpr std::array kProtocols{"local_voting", "kalman_consensus", "unbiased_kalman_consensus", "unbiased_information_consensus",
                                    "robust_information_consensus"};
    const std::string protocol = kProtocols[draws_.below(kProtocols.size())];
    const bool kalman = protocol != "local_voting";
    const bool plant = !kalman && chance(0.4);
    std::string rest = fmt::format("  initial: {{x: {{uniform: [-5, 5]{}}}{}}}\n", plant ? "" : ", dimension: 2",
                                   kalman ? ", P: {uniform: [0.5, 2]}" : "");
    if (plant)
      rest +=
          "plant:\n  model: integrator\n  initial: {position: {uniform: [-5, 5]}}\n"
          "  disturbances: [{on: measurement, gaussian: {deviation: 0.001}}]\n";
    return {protocol, protocol == "kalman_consensus" ? ", Q: 0.1, Omega: 0.1" : "", rest, kalman ? 1.0 : 0.05};
  }

  /// Agents that steer double integrators.
  System steering() {
    constexpr std::array<std::array<const char*, 2>, 4> kProtocols{{{"static_consensus", ", c: 0.5"},
                                                                    {"adaptive_consensus", ", reference: halving"},
                                                                    {"su_consensus", ""},
                                                                    {"li_edge_consensus", ""}}};
    const auto& [protocol, parameters] = kProtocols[draws_.below(kProtocols.size())];
    return {protocol, parameters, "plant:\n  model: {name: integrator, order: 2}\n  initial: {position: {uniform: [-5, 5]}}\n", 0.01};
  }

  /// Agents that estimate the states of all, or their own place from how far others are away.
  System observing_each_other() {
    if (chance(0.5)) {
      std::string rest = fmt::format("plant:\n  model: {{name: linear, A: [[{:.2f}]]}}\n  initial: {{x: {{uniform: [-1, 1]}}}}\n",
                                     draws_.uniform(-1.0, 0.3));
      rest += "  couplings: [{edge: 1 -> 2, A: [[0.5]], C: [[0.5]]}]\n";
      return {"distributed_observer",
              fmt::format(", mu: {}, weights: {}, F: 2", 5 + draws_.below(20), chance(0.5) ? "binary" : "in_degree"), rest, 0.001};
    }
    std::string relative;
    for (std::size_t i = 2; i <= agents_; ++i) relative += fmt::format("{}{}: [{}]", i > 2 ? ", " : "", i, 1 + draws_.below(i - 1));
    return {"cooperative_localization", ", F: -1",
            "plant:\n  model: {name: integrator, dimension: 2}\n  initial: {position: {uniform: [-5, 5]}}\n  sensing: {relative: {" +
                relative + "}, absolute: [1]}\n",
            0.002};
  }

  /// Agents that estimate the state of one oscillator, of which each sees one of two numbers.
  System observing_one_plant() {
    std::string rest =
        "plant:\n  model: {name: shared_linear, A: [[0, 1], [-1, 0]], C: [[1, 0]]}\n  initial: {x: {all: [1, 0]}}\n"
        "  overrides: {2: {parameters: {C: [[0, 1]]}}}\n"
        "  disturbances: [{on: state, gaussian: {intensity: 0.1}}, {on: measurement, gaussian: {intensity: 0.5}}]\n";
    if (chance(0.5)) return {"dkf_olfati_saber", ", Q: 0.1, R: 0.5, gamma: 5", rest, 0.01};
    return {"dlo_kim", ", gamma: 8, k: 1", rest, 0.01};
  }

  bool chance(double probability) { return draws_.uniform() < probability; }
  unsigned round() { return static_cast<unsigned>(1 + draws_.below(rounds_ - 2)); }

  std::string topology() {
    switch (draws_.below(6)) {
      case 0:
        symmetric_ = always_connected_ = true;
        return "ring";
      case 1:
        symmetric_ = always_connected_ = true;
        return "complete";
      case 2:
        symmetric_ = always_connected_ = true;
        return "star";
      case 3:
        always_connected_ = true;
        return "directed_ring";
      case 4:
        symmetric_ = true;
        return fmt::format("{{random_pairs: {{dwell_rounds: [1, {}]}}}}", 1 + draws_.below(5));
      default:
        return fmt::format("{{random_links: {{base: complete, probability: {:.2f}}}}}", draws_.uniform(0.2, 0.9));
    }
  }

  std::string link_rules() {
    std::string rules;
    const auto add = [&](const std::string& rule) { rules += (rules.empty() ? "" : ", ") + rule; };
    if (chance(0.3))
      add(fmt::format("loss: {:.2f}", draws_.uniform(0.0, 0.6)));
    else if (chance(0.3))
      add(fmt::format("loss: {{gilbert_elliott: {{p_good_to_bad: {:.2f}, p_bad_to_good: {:.2f}}}}}", draws_.uniform(0.01, 0.3),
                      draws_.uniform(0.1, 0.9)));
    if (chance(0.2)) add(fmt::format("delay_rounds: {{uniform: [0, {}]}}", 1 + draws_.below(4)));
    if (chance(0.15)) add(fmt::format("duplication: {:.2f}", draws_.uniform(0.0, 0.5)));
    if (chance(0.15)) add(fmt::format("reordering: {{probability: {:.2f}, later_rounds: 2}}", draws_.uniform(0.0, 0.5)));
    return rules;
  }

  /// Agent 1 is always there; what happens to another one comes in an order that makes sense.
  std::string process_events() {
    std::string events;
    if (!chance(0.5)) return events;
    for (std::size_t agent = 2; agent <= agents_; ++agent) {
      if (!chance(0.4)) continue;
      std::vector<unsigned> at{round(), round()};
      std::sort(at.begin(), at.end());
      const auto event = [&](unsigned when, const char* kind) { events += fmt::format("  - {{round: {}, {}: {}}}\n", when, kind, agent); };
      switch (draws_.below(5)) {
        case 0:
          event(at[0], "kill");
          if (at[1] > at[0]) event(at[1], "restart");
          break;
        case 1:
          event(at[0], "leave");
          if (at[1] > at[0] && chance(0.5)) event(at[1], "join");
          break;
        case 2:
          event(at[0], "join");
          break;
        case 3:
          event(at[0], "kill");
          break;
        default:
          event(at[0], "stop");
          event(at[0] + 1, "continue");
      }
    }
    return events;
  }

  std::string link_events() {
    if (agents_ < 3 || !chance(0.3)) return "";
    const unsigned first = round();
    return fmt::format("  - {{round: {}, cut: [1 <-> 2]}}\n  - {{round: {}, heal: all}}\n", first,
                       first + 1 + draws_.below(rounds_ - 1 - first));
  }

  std::uint64_t seed_;
  Stream draws_;
  std::size_t agents_;
  unsigned rounds_ = 0;
  bool symmetric_ = false, always_connected_ = false;
};

}  // namespace consort::swarm
