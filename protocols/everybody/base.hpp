#pragma once
/// One agent's estimates of everybody: what the distributed observer and cooperative localisation have in common. It keeps the slots,
/// notices who joins and who leaves, weighs what it hears, and moves everything by the models that the agents have announced.
///
/// In every round, on data of one moment: correct, then predict.
///     hat_j^(i) += (1 - e^(-mu d dt)) / d [ sum_l w_il^(j) (hat_j^(l) - hat_j^(i))  + w_i0^(i) (bar_i - hat_i^(i)) if j = i ]
///     bar_i     += dt F_i (innovation)
/// d is the sum of the weights; then the exact model of x' = A x + B u over dt, with the couplings A_jl between those that are known. The
/// consensus part is stable however large mu is, the whole first-order accurate in dt.
/// `scheme: second_order` (method ETD2 of Cox and Matthews 2002, J. Comput. Phys. 176) lets N, which is mu [...] above or F_i (innovation),
/// grow as it did since the round before, that round moved along with the model. With r = mu d, the largest of estimates that are coupled:
///     estimate += dt phi_1(-r dt) N + dt phi_2(-r dt) (growth of N)
/// where the same agents are heard with the same weights as in the round before, and without growth elsewhere.
///
/// Who is there: a message says for every agent j the newest round in which j was heard of, which travels by maximum. An agent takes up j
/// when it hears of it, at the mean of what its in-neighbours tell, and forgets j once nothing newer than m - 1 + patience rounds has come,
/// m the agreed maximum of agents; then all terms of j vanish. In round 0, where nobody has heard of anybody, an agent takes up everybody
/// that it has been told of, at zero; whoever is not heard of within that time is forgotten again.

#include "protocols/adapter.hpp"
#include "protocols/everybody/observer_design.hpp"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace consort {

/// What is known of one agent's motion.
struct KnownModel {
  Matrix A, B;
  std::vector<std::pair<AgentId, Matrix>> A_from;
  InputLaw input;
};

inline constexpr std::array kEverybodyParameters{
    ValueDoc{"weights", "one of binary, in_degree, out_degree", "binary", "w_il: 1, (11), or (12)"},
    ValueDoc{"mu", "scalar", "1", "coupling gain mu > 0 with mu_rule: given"},
    ValueDoc{"mu_rule", "one of given, undirected, directed", "given", "mu as given, or the smallest whole number above (15) or (17)"},
    ValueDoc{"rho", "scalar", "spectral radius of the agent's A", "bound of every agent's spectral radius, for (15) and (17)"},
    ValueDoc{"inputs", "one of known, own", "known", "everybody's inputs enter the estimates, or the agent's own alone (18)"},
    ValueDoc{"input_amplitude", "scalar or vector m", "0", "u_i(t) = amplitude sin(frequency t + phase)"},
    ValueDoc{"input_frequency", "scalar", "1", "rad/s"},
    ValueDoc{"input_phase", "scalar or vector m", "0", "rad"},
    ValueDoc{"scheme", "one of first_order, second_order", "first_order", "accuracy in dt; the second for mu dt of the order of 1 at most"},
    ValueDoc{"patience", "scalar", "0", "rounds without news beyond the necessary before an agent counts as gone; for links that lose"}};

template <std::size_t N>
constexpr auto with_everybody(const std::array<ValueDoc, N>& own) {
  std::array<ValueDoc, N + kEverybodyParameters.size()> all{};
  std::copy(own.begin(), own.end(), all.begin());
  std::copy(kEverybodyParameters.begin(), kEverybodyParameters.end(), all.begin() + N);
  return all;
}

/// What an agent knows when it starts.
struct EverybodyDesign {
  std::string who;  ///< for the text of errors
  AgentId self;
  Eigen::Index agents = 1, slot = 1;
  KnownModel own;
  ConsensusWeights weights = ConsensusWeights::binary;
  double mu = 1.0;
  bool inputs_known = true;
  SampledScheme scheme = SampledScheme::first_order;
  Round patience = 0;

  /// Throws ConfigError without a linear model and on parameters that make no sense.
  EverybodyDesign(const Values& parameters, const Setup& setup, std::string_view protocol);
  /// What the agent tells of itself: A, B, A_l, and the law of its input.
  [[nodiscard]] Values announcement() const;
  [[nodiscard]] Eigen::Index n() const { return own.A.rows(); }
  /// Rounds without news after which an agent is gone.
  [[nodiscard]] double bound() const { return static_cast<double>(agents - 1) + static_cast<double>(patience); }
};

/// What the rest of the class asks of one message.
struct HeardOfEverybody {
  AgentId from;
  double weight = 1.0;               ///< of the edge
  const double* x = nullptr;         ///< slots of all agents
  const double* heard_of = nullptr;  ///< by agent
  std::size_t listeners = 1;         ///< out-degree of the sender
};

/// The estimates of one agent.
class Everybody {
 public:
  /// Own estimates at the initial x (n, default zero); nobody else is known yet.
  Everybody(const EverybodyDesign& design, const Setup& setup);

  // What is sent. The numbers of nobody known are zero.
  [[nodiscard]] Numbers sent() const { return std::span(sent_.data(), static_cast<std::size_t>(sent_.size())); }
  /// By agent: the newest round in which it was heard of; -1: only told of before round 0; -2: no estimate.
  [[nodiscard]] Vector heard_of(const Sense& sense) const;

  /// Begins a round: takes up who is new, forgets who is gone. The message has the fields x, heard_of and out_degree.
  template <class Message>
  void begin_round(const EverybodyDesign& design, const Sense& sense, HeardInbox<Message> inbox) {
    inbox_.clear();
    for (const auto& heard : inbox)
      inbox_.push_back({heard.from, heard.weight, heard.message.x.data(), heard.message.heard_of.data(),
                        static_cast<std::size_t>(heard.message.out_degree)});
    begin_round(design, sense);
  }
  /// Ends it: `innovation` is F_i times what the measurements say beyond the estimates of this moment (n x 1).
  void correct_and_predict(const EverybodyDesign& design, const Sense& sense, const Vector& innovation);

  [[nodiscard]] bool knows(AgentId j) const { return known_[index_of(j)].has_value(); }
  /// hat_j^(i) (n_j x 1) of an agent that is known.
  [[nodiscard]] Eigen::Ref<const Vector> hat(AgentId j) const { return estimate_.segment(at(j), known_[index_of(j)]->A.rows()); }
  /// bar_i (n x 1).
  [[nodiscard]] Eigen::Ref<const Vector> bar() const { return estimate_.segment(bar_at_, n_); }
  /// u_i of the round that was absorbed last.
  [[nodiscard]] const Vector& control() const { return u_; }
  /// Slots of all agents, then bar_i, each padded with kAbsent.
  [[nodiscard]] const Vector& estimate() const { return estimate_; }
  [[nodiscard]] std::vector<Field> fields() const {
    const auto slot = static_cast<std::size_t>(slot_);
    return {{"x", slot, known_.size()}, {"bar", slot, 1}};
  }

 private:
  /// Estimates that move together: x+ = step x + gain u.
  struct Block {
    std::vector<std::pair<Eigen::Index, Eigen::Index>> parts;  // where in estimate_, how long
    std::vector<std::size_t> members;                          // whose, as indices
    std::vector<std::pair<AgentId, Eigen::Index>> inputs;      // whose, where in u
    Matrix step, gain;
    Vector x, u;
    Vector drive, left;  // second order: N of this round, and that of the last one, moved along

    void gather(const Vector& from, Vector& part) const;
    void scatter(const Vector& part, Vector& to) const;
  };
  void begin_round(const EverybodyDesign& design, const Sense& sense);
  void learn(const EverybodyDesign& design, AgentId j, const Values& told);
  void forget(AgentId j);
  void replan();
  void hear(const EverybodyDesign& design, const Sense& sense);
  void correct(const EverybodyDesign& design, Seconds dt, const Vector& innovation);
  void correct_further(Block& block, double mu, Seconds dt);
  void plan(const EverybodyDesign& design, Seconds dt);
  [[nodiscard]] Block block_of(const EverybodyDesign& design, const std::vector<std::size_t>& members, Seconds dt) const;
  [[nodiscard]] Eigen::Index at(AgentId j) const { return static_cast<Eigen::Index>(index_of(j)) * slot_; }

  AgentId self_;
  Eigen::Index slot_, bar_at_, n_;
  Vector estimate_, sent_, u_;
  Vector heard_;                                  // by agent
  std::vector<std::optional<KnownModel>> known_;  // by agent: of those that are estimated
  std::vector<Block> blocks_;                     // empty: to be planned
  std::vector<HeardOfEverybody> inbox_;           // of this round
  Vector pull_, weight_;                          // of this round: as in estimate_, by agent
  Vector last_weight_;                            // by agent; zero: blocks have nothing left of a round before
};

}  // namespace consort
