#pragma once
/// One agent of a protocol that steers a plant, driven by hand.

#include "protocols/adapter.hpp"
#include "protocols/registry.hpp"

#include <memory>
#include <vector>

namespace consort {

/// Knows a double integrator in `dimension` coordinates, measures its whole state.
class PlantAgent {
 public:
  PlantAgent(std::string_view protocol, const std::map<std::string, double>& parameters, const std::map<std::string, double>& initial,
             Seconds dt, std::size_t measurement = 2)
      : dt_(dt) {
    Values given, start, model;
    for (const auto& [name, value] : parameters) given.set(name, value);
    for (const auto& [name, value] : initial) start.set(name, value);
    model.set("A", (Matrix(2, 2) << 0, 1, 0, 0).finished());
    model.set("B", (Matrix(2, 1) << 0, 1).finished());
    model.set("C", Matrix(Matrix::Identity(2, 2)));
    protocol_ = make_protocol(find_protocol(protocol), given, Setup{AgentId{1}, 9, dt, start, model, measurement}, 1);
  }

  /// A message as `protocol_`'s layout has it: y first, then the rest.
  struct From {
    unsigned sender;
    std::vector<double> payload;
  };
  /// One round: `scheduled` in-neighbours with weights, of which those in `heard` arrive.
  void absorb(const std::vector<double>& y, const std::vector<Neighbour>& scheduled, const std::vector<From>& heard) {
    std::vector<Received> inbox;
    for (const From& from : heard) {
      double weight = 1.0;
      for (const Neighbour& neighbour : scheduled)
        if (neighbour.id.value == from.sender) weight = neighbour.weight;
      inbox.push_back({AgentId{from.sender}, k_, weight, from.payload});
    }
    protocol_->absorb(Sense{k_++, dt_, scheduled, 1, y, AgentId{1}}, inbox);
  }
  [[nodiscard]] std::vector<double> emit(const std::vector<double>& y, const std::vector<Neighbour>& scheduled) const {
    std::vector<double> payload(protocol_->message_layout().size());
    protocol_->emit(Sense{k_, dt_, scheduled, 1, y, AgentId{1}}, payload);
    return payload;
  }
  [[nodiscard]] std::vector<double> estimate() const {
    std::vector<double> out(protocol_->estimate_layout().size());
    protocol_->estimate(out);
    return out;
  }
  [[nodiscard]] double control() const {
    double u = 0.0;
    protocol_->control(std::span(&u, 1));
    return u;
  }

 private:
  Seconds dt_;
  std::unique_ptr<Protocol> protocol_;
  Round k_ = 0;
};

}  // namespace consort
