#include "protocols/everybody/base.hpp"

#include "core/counted.hpp"
#include "core/math/discretise.hpp"
#include "protocols/everybody/relative_sensing.hpp"

#include <cmath>
#include <limits>

namespace consort {
namespace {

constexpr double kTold = -1.0, kNobody = -2.0;  // where a round would stand

// A, B and the A_l out of `model`, the law of the input out of `input`.
KnownModel known_model(const Values& model, const Values& input, std::size_t agents, const std::string& who) {
  const Matrix* A = model.find("A");
  const Matrix* B = model.find("B");
  if (A == nullptr || B == nullptr) throw ConfigError(who + " does not know its dynamics; allowed: a linear plant model (A, B, C)");
  KnownModel known{*A, *B, {}, {}};
  for (std::size_t l = 0; l < agents; ++l)
    if (const Matrix* A_l = model.find("A_" + std::to_string(l + 1))) known.A_from.emplace_back(agent_at(l), *A_l);
  known.input = input_law(input, B->cols(), who);
  return known;
}

}  // namespace

void Everybody::Block::gather(const Vector& from, Vector& part) const {
  Eigen::Index row = 0;
  for (const auto& [where, n] : parts) {
    part.segment(row, n) = from.segment(where, n);
    row += n;
  }
}

void Everybody::Block::scatter(const Vector& part, Vector& to) const {
  Eigen::Index row = 0;
  for (const auto& [where, n] : parts) {
    to.segment(where, n) = part.segment(row, n);
    row += n;
  }
}

EverybodyDesign::EverybodyDesign(const Values& parameters, const Setup& setup, std::string_view protocol)
    : who("protocol " + std::string(protocol) + ": agent " + std::to_string(setup.self.value)),
      self(setup.self),
      agents(static_cast<Eigen::Index>(setup.agents)),
      slot(static_cast<Eigen::Index>(setup.largest_state)),
      own(known_model(setup.model, parameters, setup.agents, who)),
      weights(consensus_weights(parameters)),
      mu(coupling_gain(parameters, setup.agents, own.A, who)),
      inputs_known(consort::inputs_known(parameters)),
      scheme(sampled_scheme(parameters)),
      patience(patience_of(parameters, who)) {
  check(slot >= n(), "the largest state of all agents is at least an agent's own");
}

Values EverybodyDesign::announcement() const {
  Values told;
  told.set("A", own.A);
  told.set("B", own.B);
  for (const auto& [l, A_l] : own.A_from) told.set("A_" + std::to_string(l.value), A_l);
  if (!own.input.zero()) {
    told.set("input_amplitude", Matrix(own.input.amplitude));
    told.set("input_frequency", own.input.frequency);
    told.set("input_phase", Matrix(own.input.phase));
  }
  return told;
}

Everybody::Everybody(const EverybodyDesign& design, const Setup& setup)
    : self_(design.self),
      slot_(design.slot),
      bar_at_(design.agents * design.slot),
      n_(design.n()),
      estimate_(Vector::Constant(bar_at_ + slot_, kAbsent)),
      sent_(Vector::Zero(bar_at_)),
      u_(Vector::Zero(design.own.B.cols())),
      heard_(Vector::Constant(design.agents, kNobody)),
      known_(setup.agents),
      pull_(bar_at_ + slot_),
      weight_(design.agents),
      last_weight_(Vector::Zero(design.agents)) {
  const Vector x = setup.initial.has("x") ? setup.initial.vector("x") : Vector::Zero(n_);
  if (x.size() != n_)
    throw ConfigError(design.who + ": found an initial x of length " + std::to_string(x.size()) + "; allowed: the length of its state, " +
                      std::to_string(n_));
  known_[index_of(self_)] = design.own;
  estimate_.segment(at(self_), n_) = x;
  estimate_.segment(bar_at_, n_) = x;
  sent_.segment(at(self_), n_) = x;
}

Vector Everybody::heard_of(const Sense& sense) const {
  Vector out = heard_;
  for (std::size_t j = 0; sense.k == 0 && j < known_.size(); ++j)
    if (sense.announced(agent_at(j)) != nullptr) out[static_cast<Eigen::Index>(j)] = kTold;
  out[static_cast<Eigen::Index>(index_of(self_))] = static_cast<double>(sense.k);
  return out;
}

void Everybody::learn(const EverybodyDesign& design, AgentId j, const Values& told) {
  KnownModel model = known_model(told, told, known_.size(), design.who + ", told by agent " + std::to_string(j.value));
  const Eigen::Index n = model.A.rows();
  if (n > slot_)
    throw RunError(design.who + ": agent " + std::to_string(j.value) + " announced " + counted(static_cast<std::uint64_t>(n), "state") +
                   "; agreed: at most " + std::to_string(slot_));
  // Those that have heard of j tell where to begin; if nobody has, zero.
  Vector sum = Vector::Zero(n);
  double tellers = 0.0;
  for (const HeardOfEverybody& heard : inbox_) {
    if (heard.heard_of[static_cast<Eigen::Index>(index_of(j))] < 0.0) continue;
    sum += Eigen::Map<const Vector>(heard.x + at(j), n);
    tellers += 1.0;
  }
  estimate_.segment(at(j), n) = sum / std::max(tellers, 1.0);
  known_[index_of(j)] = std::move(model);
  replan();
}

void Everybody::forget(AgentId j) {
  estimate_.segment(at(j), slot_).setConstant(kAbsent);
  known_[index_of(j)].reset();
  replan();
}

void Everybody::begin_round(const EverybodyDesign& design, const Sense& sense) {
  for (const HeardOfEverybody& heard : inbox_)
    for (Eigen::Index j = 0; j < heard_.size(); ++j)
      if (heard.heard_of[j] >= 0.0) heard_[j] = std::max(heard_[j], heard.heard_of[j]);
  for (std::size_t index = 0; index < known_.size(); ++index) {
    const AgentId j = agent_at(index);
    if (j == self_) continue;
    double& heard = heard_[static_cast<Eigen::Index>(index)];
    const Values* told = sense.announced(j);
    if (sense.k == 0 && heard == kNobody && told != nullptr) heard = kTold;
    const double newest = std::max(heard, 0.0);  // told of counts as heard of in round 0
    const bool there = heard != kNobody && static_cast<double>(sense.k) - newest <= design.bound();
    if (there && !knows(j) && told != nullptr) learn(design, j, *told);
    if (!there && knows(j)) forget(j);
    if (!knows(j)) heard = kNobody;
  }
}

void Everybody::replan() {
  blocks_.clear();
  last_weight_.setZero();
}

void Everybody::hear(const EverybodyDesign& design, const Sense& sense) {
  pull_.setZero();
  weight_.setZero();
  const std::size_t in_degree = sense.in_neighbours.size();
  const auto own = static_cast<Eigen::Index>(index_of(self_));
  for (const HeardOfEverybody& heard : inbox_) {
    // w_il^(j), which bar_i makes another one for j = i                                                          (11), (12)
    const double w = consensus_weight(design.weights, heard.weight, in_degree, heard.listeners);
    const double w_own = consensus_weight(design.weights, heard.weight, in_degree + 1, heard.listeners);
    for (Eigen::Index j = 0; j < weight_.size(); ++j) {
      const AgentId agent = agent_at(static_cast<std::size_t>(j));
      if (!knows(agent) || heard.heard_of[j] < kTold) continue;
      const Eigen::Index n = known_[index_of(agent)]->A.rows();
      const double w_il = j == own ? w_own : w;
      pull_.segment(at(agent), n) += w_il * (Eigen::Map<const Vector>(heard.x + at(agent), n) - estimate_.segment(at(agent), n));
      weight_[j] += w_il;
    }
  }
  const double w_i0 = consensus_weight(design.weights, 1.0, in_degree + 1, 1);
  pull_.segment(at(self_), n_) += w_i0 * (bar() - hat(self_));
  weight_[own] += w_i0;
}

void Everybody::correct(const EverybodyDesign& design, Seconds dt, const Vector& innovation) {
  for (Eigen::Index j = 0; j < weight_.size(); ++j) {
    const AgentId agent = agent_at(static_cast<std::size_t>(j));
    if (!(weight_[j] > 0.0)) continue;
    const Eigen::Index n = known_[index_of(agent)]->A.rows();
    estimate_.segment(at(agent), n) -= std::expm1(-design.mu * weight_[j] * dt) / weight_[j] * pull_.segment(at(agent), n);
  }
  estimate_.segment(bar_at_, n_) += dt * innovation;
}

void Everybody::correct_further(Block& block, double mu, Seconds dt) {
  double d = 0.0;
  for (const std::size_t j : block.members) d = std::max(d, weight_[static_cast<Eigen::Index>(j)]);
  const Relaxation weight = relaxation(mu * d, dt);
  block.gather(pull_, block.drive);
  if (weight_ != last_weight_) block.left = block.drive;
  const Vector added = weight.now * block.drive + weight.growth * (block.drive - block.left);
  block.x += added;
  block.left.noalias() = block.step * (block.drive - mu * d * added);
}

void Everybody::plan(const EverybodyDesign& design, Seconds dt) {
  // Agents that are coupled move together; the rest each for itself.
  std::vector<Edge> couplings;
  for (std::size_t j = 0; j < known_.size(); ++j) {
    if (!known_[j]) continue;
    for (const auto& [l, A_jl] : known_[j]->A_from)
      if (knows(l)) couplings.push_back({l, agent_at(j)});
  }
  const std::vector<std::size_t> group = coupled_groups(known_.size(), couplings);
  for (std::size_t g = 0; g < group.size(); ++g) {
    std::vector<std::size_t> members;
    for (std::size_t j = 0; j < group.size(); ++j)
      if (known_[j] && group[j] == g) members.push_back(j);
    if (!members.empty()) blocks_.push_back(block_of(design, members, dt));
  }
}

Everybody::Block Everybody::block_of(const EverybodyDesign& design, const std::vector<std::size_t>& members, Seconds dt) const {
  Block block;
  block.members = members;
  std::vector<std::size_t> whose;  // of each part
  std::vector<Eigen::Index> begin(known_.size(), 0);
  Eigen::Index size = 0, inputs = 0;
  const auto add = [&](std::size_t j, Eigen::Index where) {
    block.parts.emplace_back(where, known_[j]->A.rows());
    whose.push_back(j);
    size += known_[j]->A.rows();
  };
  for (const std::size_t j : members) {
    begin[j] = size;
    add(j, at(agent_at(j)));
  }
  if (std::find(members.begin(), members.end(), index_of(self_)) != members.end()) add(index_of(self_), bar_at_);
  std::vector<Eigen::Index> input_at(known_.size(), -1);
  for (const std::size_t j : members) {
    const KnownModel& model = *known_[j];
    if (model.input.zero() || (!design.inputs_known && agent_at(j) != self_)) continue;
    input_at[j] = inputs;
    block.inputs.emplace_back(agent_at(j), inputs);
    inputs += model.B.cols();
  }
  Matrix A = Matrix::Zero(size, size), B = Matrix::Zero(size, inputs);
  Eigen::Index row = 0;
  for (const std::size_t j : whose) {
    const KnownModel& model = *known_[j];
    const Eigen::Index n = model.A.rows();
    A.block(row, row, n, n) = model.A;
    for (const auto& [l, A_jl] : model.A_from)
      if (knows(l)) A.block(row, begin[index_of(l)], n, A_jl.cols()) = A_jl;
    if (input_at[j] >= 0) B.block(row, input_at[j], n, model.B.cols()) = model.B;
    row += n;
  }
  const Discrete exact = discretise(A, inputs > 0 ? B : Matrix(), {}, dt);
  block.step = exact.A;
  block.gain = inputs > 0 ? exact.B : Matrix(size, 0);
  for (Vector* part : {&block.x, &block.drive, &block.left}) part->resize(size);
  block.u.resize(inputs);
  return block;
}

void Everybody::correct_and_predict(const EverybodyDesign& design, const Sense& sense, const Vector& innovation) {
  hear(design, sense);
  const bool second_order = design.scheme == SampledScheme::second_order;
  if (second_order) {
    pull_ *= design.mu;
    pull_.segment(bar_at_, n_) = innovation;
  } else {
    correct(design, sense.dt, innovation);
  }
  if (blocks_.empty()) plan(design, sense.dt);
  const Seconds t = static_cast<double>(sense.k) * sense.dt;
  u_ = design.own.input.at(t);
  for (Block& block : blocks_) {
    block.gather(estimate_, block.x);
    if (second_order) correct_further(block, design.mu, sense.dt);
    for (const auto& [j, where] : block.inputs) {
      const InputLaw& law = known_[index_of(j)]->input;
      block.u.segment(where, law.amplitude.size()) = law.at(t);
    }
    block.x = (block.step * block.x + block.gain * block.u).eval();
    block.scatter(block.x, estimate_);
  }
  last_weight_ = weight_;
  for (Eigen::Index c = 0; c < bar_at_; ++c) sent_[c] = is_absent(estimate_[c]) ? 0.0 : estimate_[c];
}

}  // namespace consort
