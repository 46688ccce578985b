#pragma once
/// Agents average their information, and what a link loses arrives with the next message that gets through: what is sent is not what is
/// given away this round, but all that has been given away so far. Every agent reaches the centralised estimate at every loss below 1.
///
///     sigma_i[k+1] = sigma_i[k] + s_i[k] / (1 + mu_i)                                              sent, the same to all listeners
///     rho_ij[k+1]  = sigma_j[k+1] if the message of j arrives, else rho_ij[k]                      newest running sum heard of j
///     s_i[k+1]     = s_i[k] / (1 + mu_i) + sum_{j != i} (rho_ij[k+1] - rho_ij[k])
///     x_i = Y_i^-1 y_i        with s = (Y, y), Y_i[0] = P_i(0)^-1, y_i[0] = Y_i[0] x_i(0), sigma[0] = rho[0] = 0
///
/// Source: Hadjicostis, Vaidya, Dominguez-Garcia, "Robust distributed average consensus via exchange of running sums", IEEE TAC 61(6),
/// 2016, Algorithm 1, with the two scalars of its ratio replaced by the information matrix Y and the information vector y.
/// Assumes: a strongly connected topology without switching; P_i(0) > 0; every link gets a message through again and again. Then
/// sum_i s_i + sum_(j -> i) (sigma_j - rho_ij) never changes, and all x_i go to (sum P_i^-1)^-1 sum P_i^-1 x_i.
/// Late, overtaken and repeated messages do no harm: only a running sum newer than the last one counts. mu counts listeners, so the weight
/// of an edge is not used. The link's noise disturbs the running sum y (it does not pile up: only the newest one counts).
///
/// An edge that appears later (switching, a heal, a join) must not bring what was given to others before it was there, so of a sender that
/// was there before, the first message that arrives counts with what it gave away in its own round alone. Without loss that is exact.
/// With loss, what a link loses between its appearance and its first message, and between its last message and its disappearance, is
/// gone: x_i stays a weighted average of the initial values, but is no longer the centralised one. Whoever leaves takes what it holds.
/// A missing message costs nothing but time. An agent that hears nobody keeps its share 1/(1 + mu_i) of what it holds from round to round;
/// once one of its informations is below 2^-900 it gives nothing more away and keeps what it has, so x stands, and nothing is lost. Running
/// sums grow with k, and differences of them lose k parts in 1e16 until the agent is 1024 rounds old; from then on what rounding takes from
/// a sum is summed beside it and sent with it, and nothing more is lost. A process that is started again brings its initial information a
/// second time.

#include "protocols/adapter.hpp"
#include "protocols/consensus/theory.hpp"

namespace consort {

template <int N>
struct RobustInformationConsensus {
  static constexpr std::string_view name = "robust_information_consensus";
  static constexpr std::string_view summary = "centralised estimate despite lost messages: running sums of information are exchanged";
  static constexpr std::string_view source = "Hadjicostis, Vaidya, Dominguez-Garcia 2016, Algorithm 1, on the information form";
  static constexpr std::string_view assumptions = "strongly connected, no switching; any loss below 1";
  static constexpr auto examine = examine_robust_information_consensus;
  static constexpr std::array<ValueDoc, 0> parameters{};
  static constexpr std::array initial{
      ValueDoc{"x", "vector n", "", "initial estimate x_i(0)"},
      ValueDoc{"P", "covariance n x n (scalar, diagonal or matrix)", "1", "covariance of x_i(0), > 0; Y_i(0) is its inverse"}};
  static constexpr std::array recorded_values{
      ValueDoc{"Y", "matrix n x n", "", "information Y_i, of which x_i = Y_i^-1 y_i (1 / unit of x squared)"}};

  using Vec = Eigen::Matrix<double, N, 1>;
  using Mat = Eigen::Matrix<double, N, N>;
  struct Params {};
  /// Information: what one knows of x, as y = Y x.
  struct Mass {
    Mat Y;
    Vec y;
    Mass& operator+=(const Mass& other) {
      Y += other.Y;
      y += other.y;
      return *this;
    }
    Mass& operator-=(const Mass& other) {
      Y -= other.Y;
      y -= other.y;
      return *this;
    }
    friend Mass operator*(double factor, const Mass& mass) { return {factor * mass.Y, factor * mass.y}; }
  };
  /// What agent i knows of the edge from j.
  struct Incoming {
    AgentId from;
    Round appeared = 0;  ///< first round of its presence that lasts, or lasted last
    Round present = 0;   ///< last round in which it was there
    bool heard = false;  ///< since it appeared
    Round newest = 0;    ///< round of the newest message heard
    double since = 0;    ///< first round of the sender
    Mass rho, rho_low;   ///< its running sum, and what rounding took from it
  };
  struct State {
    Mass s;                      ///< what the agent holds
    Mass sigma, sigma_low;       ///< all it has given to each listener so far, and what rounding took from that
    double since = -1;           ///< its own first round; -1: not begun
    std::vector<Incoming> from;  ///< ascending by sender
    Vec x;
  };
  struct Message {
    Mat Y;  ///< running sums, this round's share in them
    Vec y;
    Mat Y_given;  ///< this round's share
    Vec y_given;
    double since;  ///< first round of the sender
    Mat Y_low;     ///< what rounding took from the running sums
    Vec y_low;
    static constexpr std::array<std::string_view, 7> field_names{"Y_sum", "y_sum", "Y_given", "y_given", "since", "Y_low", "y_low"};
    static constexpr std::string_view noisy_field = "y_sum";
    static auto fields(auto& m) { return std::tie(m.Y, m.y, m.Y_given, m.y_given, m.since, m.Y_low, m.y_low); }
  };

  static Params params(const Values&, Eigen::Index) { return {}; }
  static State init(const Params&, const Setup& setup) {
    const Vec x = setup.initial.vector("x");
    const Mat P = setup.initial.covariance("P", x.size(), 1.0, true);
    const Mat Y = SpdInverse<N>(x.size(), {name, setup.self, 0})(P, "P_i(0)");
    const Mass none{Mat::Zero(x.size(), x.size()), Vec::Zero(x.size())};
    return {{Y, Y * x}, none, none, -1, {}, x};
  }
  static Message message(const Params&, const State& s, const Sense& sense) {
    const Mass given = share(s, sense) * s.s;
    const auto [sum, low] = running_sum(s, given, sense.k);
    return {sum.Y, sum.y, given.Y, given.y, s.since < 0 ? sense.k : s.since, low.Y, low.y};
  }

  /// State at k + 1. Throws RunError on a Y that cannot be inverted.
  static void transition(const Params&, State& s, const Sense& sense, HeardInbox<Message> inbox) {
    update_presence(s, sense);
    if (const double part = share(s, sense); part > 0.0) {
      s.s = part * s.s;  // each listener's share and its own are alike
      std::tie(s.sigma, s.sigma_low) = running_sum(s, s.s, sense.k);
    }
    if (s.since < 0) s.since = sense.k;
    for (const auto& [from, sent, weight, heard] : inbox) receive(s, from, sent, heard);
    s.x.noalias() = SpdInverse<N>(s.x.size(), {name, sense.self, sense.k})(s.s.Y, "Y_i+") * s.s.y;
  }

  static const Vec& estimate(const State& s) { return s.x; }
  static auto recorded(const Params&, const State& s) { return std::tie(s.s.Y); }

 private:
  /// What each listener is given of s; 0 if it is too little to be told from a running sum.
  static double share(const State& s, const Sense& sense) {
    constexpr double kLeast = 0x1p-900;
    return s.s.Y.diagonal().minCoeff() < kLeast ? 0.0 : 1.0 / (1.0 + static_cast<double>(sense.out_degree));
  }

  /// sigma and what rounding took from it, with what is given in round k.
  static std::pair<Mass, Mass> running_sum(const State& s, const Mass& given, Round k) {
    constexpr double kOld = 1024;  // rounds, after which rounding begins to show
    std::pair<Mass, Mass> out{s.sigma, s.sigma_low};
    auto& [sum, low] = out;
    sum += given;
    if (s.since < 0 || k - s.since < kOld) return out;
    low += Mass{taken(s.sigma.Y, given.Y, sum.Y), taken(s.sigma.y, given.y, sum.y)};
    return out;
  }
  /// a + b - sum, exactly, where sum is a + b rounded (Knuth's TwoSum).
  template <class T>
  static T taken(const T& a, const T& b, const T& sum) {
    const T of_b = sum - a;
    return (a - (sum - of_b)) + (b - of_b);
  }

  static auto place_of(State& s, AgentId from) {
    return std::lower_bound(s.from.begin(), s.from.end(), from, [](const Incoming& edge, AgentId id) { return edge.from < id; });
  }

  /// Which edges are new in round k.
  static void update_presence(State& s, const Sense& sense) {
    for (const Neighbour& neighbour : sense.in_neighbours) {
      auto edge = place_of(s, neighbour.id);
      if (edge == s.from.end() || edge->from != neighbour.id)
        edge = s.from.insert(edge, Incoming{neighbour.id, sense.k, sense.k, false, 0, 0, s.s, s.s});
      else if (edge->present + 1 < sense.k)
        *edge = Incoming{neighbour.id, sense.k, sense.k, false, 0, 0, std::move(edge->rho), std::move(edge->rho_low)};
      edge->present = sense.k;
    }
  }

  static void receive(State& s, AgentId from, Round sent, const Message& heard) {
    const auto edge = place_of(s, from);
    if (edge == s.from.end() || edge->from != from || sent < edge->appeared || (edge->heard && sent <= edge->newest)) return;
    const Mass sum{heard.Y, heard.y}, low{heard.Y_low, heard.y_low};
    if (edge->heard && edge->since == heard.since) {
      Mass difference = sum;  // formed first: what the agent holds may be small against running sums
      difference -= edge->rho;
      difference += low;
      difference -= edge->rho_low;
      s.s += difference;
    } else if (heard.since >= edge->appeared) {
      s.s += sum;  // the sender was not there before: all of it was for us
      s.s += low;
    } else {
      s.s += Mass{heard.Y_given, heard.y_given};
    }
    edge->heard = true;
    edge->newest = sent;
    edge->since = heard.since;
    edge->rho = sum;
    edge->rho_low = low;
  }
};

}  // namespace consort
