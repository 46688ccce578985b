#pragma once
/// Agents of one protocol that observe one plant, driven by hand: the plant moves by exp(A dt) and nothing disturbs anything unless told.

#include "core/math/discretise.hpp"
#include "core/network/graph.hpp"
#include "protocols/protocol.hpp"
#include "protocols/registry.hpp"

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace consort {

class ObservingAgents {
 public:
  struct Settings {
    std::string protocol;
    Matrix A;
    std::vector<Matrix> C;  ///< by agent; 0 x n: no sensor
    Graph graph;
    Seconds dt = 0.01;
    std::map<std::string, double> parameters;             ///< of everybody
    std::map<std::string, std::vector<double>> by_agent;  ///< parameters with one value per agent
    std::vector<Values> initial;                          ///< by agent; empty: no initial values
    Vector x;
  };

  explicit ObservingAgents(Settings settings)
      : settings_(std::move(settings)), x_(settings_.x), step_(matrix_exponential(settings_.A, settings_.dt)) {
    const ProtocolEntry& entry = find_protocol(settings_.protocol);
    for (std::size_t i = 0; i < settings_.C.size(); ++i) {
      Values parameters, model;
      for (const auto& [name, value] : settings_.parameters) parameters.set(name, value);
      for (const auto& [name, values] : settings_.by_agent) parameters.set(name, values[i]);
      model.set("A", settings_.A);
      const Matrix& C = settings_.C[i];
      if (C.rows() > 0) model.set("C", C);
      const Values initial = settings_.initial.empty() ? Values{} : settings_.initial[i];
      agents_.push_back(
          entry.make(parameters, Setup{agent_at(i), settings_.C.size(), settings_.dt, initial, model, static_cast<std::size_t>(C.rows())}));
    }
  }

  std::function<bool(Edge)> lost = [](Edge) { return false; };             ///< whether a message is lost
  std::function<void(std::size_t, Vector&)> disturb = [](auto, auto&) {};  ///< what y_i of agent index i gets

  void round() {
    std::vector<std::vector<double>> y, payloads;
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      Vector measured = settings_.C[i] * x_;
      disturb(i, measured);
      y.emplace_back(measured.begin(), measured.end());
      payloads.emplace_back(agents_[i]->message_layout().size());
      agents_[i]->emit(sense(i, y[i]), payloads[i]);
    }
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      std::vector<Received> inbox;
      for (const Neighbour& j : settings_.graph.in_neighbours(agent_at(i)))
        if (!lost({j.id, agent_at(i)})) inbox.push_back({j.id, k_, j.weight, payloads[index_of(j.id)]});
      agents_[i]->absorb(sense(i, y[i]), inbox);
    }
    x_ = step_ * x_;
    ++k_;
  }
  void rounds(int count) {
    for (int i = 0; i < count; ++i) round();
  }

  [[nodiscard]] const Vector& plant() const { return x_; }
  [[nodiscard]] Vector all_of(std::size_t i) const {
    Vector out(static_cast<Eigen::Index>(agents_[i]->estimate_layout().size()));
    agents_[i]->estimate({out.data(), static_cast<std::size_t>(out.size())});
    return out;
  }
  [[nodiscard]] Vector estimate(std::size_t i) const { return all_of(i).head(x_.size()); }
  [[nodiscard]] Vector error(std::size_t i) const { return estimate(i) - x_; }
  [[nodiscard]] double error() const {
    double squares = 0.0;
    for (std::size_t i = 0; i < agents_.size(); ++i) squares += error(i).squaredNorm();
    return std::sqrt(squares);
  }
  /// The covariance that agent index i states.
  [[nodiscard]] Matrix P(std::size_t i) const {
    const Vector all = all_of(i);
    return Eigen::Map<const Matrix>(all.data() + x_.size(), x_.size(), x_.size());
  }
  [[nodiscard]] Protocol& agent(std::size_t i) { return *agents_[i]; }

 private:
  [[nodiscard]] Sense sense(std::size_t i, std::span<const double> y) const {
    return {.k = k_,
            .dt = settings_.dt,
            .in_neighbours = settings_.graph.in_neighbours(agent_at(i)),
            .out_degree = settings_.graph.out_degree(agent_at(i)),
            .y = y,
            .self = agent_at(i)};
  }

  Settings settings_;
  Vector x_;
  Matrix step_;
  std::vector<std::unique_ptr<Protocol>> agents_;
  Round k_ = 0;
};

}  // namespace consort
