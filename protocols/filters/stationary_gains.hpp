#pragma once
/// The gains at which the filters and observers of one experiment settle on one graph, for those who look at it from outside.

#include "protocols/filters/estimator_network.hpp"
#include "protocols/theory_case.hpp"

#include <utility>
#include <vector>

namespace consort {

enum class FilterKind { centralised, olfati_saber, iterative, kim, luenberger_kim, luenberger_zhang };

double weighted_in_degree(const Graph& graph, AgentId agent);
/// The places of agent i, counted from 0, and if asked for of its in-neighbours.
std::vector<std::size_t> with_in_neighbours(const Graph& graph, std::size_t i, bool in_neighbours);

/// Everything throws ConfigError where there are no such gains, and RunError where they were not found.
class StationaryGains {
 public:
  /// C by agent: 0 x n measures nothing. What is given must outlive this.
  StationaryGains(FilterKind kind, const TheoryCase& of, const Matrix& A, const std::vector<Matrix>& C, const Graph& graph)
      : kind_(kind), of_(of), A_(A), C_(C), graph_(graph) {}

  /// Of all kinds but the iterative one.
  [[nodiscard]] EstimatorNetwork network() const;
  /// Of the iterative one, A = exp(A_plant dt), and the largest epsilon d_i |M_i| that is not kept to 1.
  [[nodiscard]] std::pair<std::vector<IterativeFilter>, double> iterative(const Matrix& step) const;

 private:
  [[nodiscard]] Values parameters(std::size_t i) const { return of_.parameters(agent_at(i)); }
  [[nodiscard]] Matrix noise_weight(const char* name, std::size_t i, bool of_measurement) const;
  [[nodiscard]] Matrix information_around(std::size_t i, bool in_neighbours) const;
  [[nodiscard]] EstimatorNetwork luenberger_network() const;

  FilterKind kind_;
  const TheoryCase& of_;
  const Matrix& A_;
  const std::vector<Matrix>& C_;
  const Graph& graph_;
};

}  // namespace consort
