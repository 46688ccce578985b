#pragma once
/// Where a coupling gain c_i should settle: the reference kappa_i, found by each agent alone while the network runs. Knotek, thesis,
/// section 4.6. A protocol owns a Reference and carries what it exchanges (r, q) in its message.
///
/// fixed: kappa_i as given.
///
/// halving (Algorithm 4.1; any graph): c_i is sampled at frequency f_s over a window. The mean of the largest and the smallest sample is
/// the new kappa_i, so kappa_i grows as long as c_i swings, which it does until the agents agree. The text of the algorithm can be read in
/// two ways: a window is filled, gives one kappa_i and is emptied (block, as section 4.6.1 describes it), or it slides and gives one with
/// every sample (sliding, as the numbered steps say; it starts full of c_i(0)). A change of kappa_i that is not larger than the dead zone
/// is not made: against noise, which keeps c_i moving for ever.
///
/// eigenvalue (Algorithm 4.2; undirected graphs): artificial states, r_i' = -xi sum_j w_ij (q_i - q_j), q_i' = xi sum_j w_ij (r_i - r_j)
/// (4.87), started at +1 or -1, oscillate at the frequencies xi lambda_k(L) rad/s. A Fourier transform of z_i = r_i + i q_i over a window
/// finds the smallest that is not zero, and kappa_i = 1 / (2 lambda) (4.88). Symplectic: r_i moves in even rounds and q_i in odd ones, by
/// two rounds each, so one exchange per round is enough and the amplitude neither grows nor decays if dt xi lambda_max < 1. The frequency
/// that this shifts (2 sin(theta / 2) per step, theta the angle of a step) is shifted back. Because z_i turns one way only (e^{i xi lambda
/// t}), nothing is folded at zero; a Hann window separates a line from the constant part if xi lambda_2 window >= 4 pi, and the sampling
/// tells all lines apart from their aliases if xi lambda_max < pi f_s. A line an agent does not see (below 5 % of its strongest) leaves it
/// with a larger one (Remark 33). Its sums lack the terms of missing messages; then the matrix is not symmetric in that round and the
/// amplitudes drift.

#include "core/number_text.hpp"
#include "protocols/adaptive/gains.hpp"
#include "protocols/protocol.hpp"

#include <unsupported/Eigen/FFT>

#include <algorithm>
#include <complex>
#include <numbers>
#include <vector>

namespace consort {

class Reference {
 public:
  enum class Kind { fixed, halving, eigenvalue };
  static constexpr std::array parameters{
      ValueDoc{"reference", "one of fixed, halving, eigenvalue", "fixed", "how kappa_i is found"},
      ValueDoc{"halving", "one of block, sliding", "block", "halving: one kappa per window, or one per sample"},
      ValueDoc{"sampling", "scalar", "10 (halving), 50 (eigenvalue)", "f_s, Hz; a whole number of rounds between samples"},
      ValueDoc{"window", "scalar", "5", "length of the window, s"},
      ValueDoc{"dead_zone", "scalar", "0", "halving: smaller changes of kappa are not made"},
      ValueDoc{"xi", "scalar", "none; eigenvalue needs it", "eigenvalue: rad/s per unit of Laplacian eigenvalue"}};
  static constexpr std::array initial{
      ValueDoc{"kappa", "scalar", "c", "reference kappa_i(0), > 0"},
      ValueDoc{"r", "scalar", "none; eigenvalue needs it", "its sign is r_i(0), so that uniform: [-1, 1] draws +1 or -1"},
      ValueDoc{"q", "scalar", "none; eigenvalue needs it", "its sign is q_i(0)"}};

  /// What stays.
  struct Rule {
    Kind kind = Kind::fixed;
    bool sliding = false;
    Round sample_rounds = 1;
    std::size_t samples = 1;  ///< in a window
    double dead_zone = 0.0, xi = 0.0;
    Seconds dt = 1.0;
  };
  /// What moves.
  struct State {
    double kappa = 0.0;
    double r = 0.0, q = 0.0;
    Round rounds = 0;                     ///< since the window was begun
    std::size_t taken = 0;                ///< samples since then
    double low = 0.0, high = 0.0;         ///< block
    std::vector<double> c;                ///< sliding: the newest samples, `taken` mod size is the oldest
    std::vector<std::complex<double>> z;  ///< eigenvalue: samples of r + i q
  };

  /// Throws ConfigError.
  static Rule rule(std::string_view who, const Values& values, Seconds dt) {
    Rule rule;
    rule.kind = static_cast<Kind>(static_cast<int>(values.scalar("reference", 0.0)));
    rule.dt = dt;
    if (rule.kind == Kind::fixed) return rule;
    const bool eigenvalue = rule.kind == Kind::eigenvalue;
    const double sampling = positive_parameter(who, values, "sampling", eigenvalue ? 50.0 : 10.0);
    const double window = positive_parameter(who, values, "window", 5.0);
    rule.sample_rounds = whole(who, "rounds between two samples (1 / (sampling * dt))", 1.0 / (sampling * dt), 1.0);
    rule.samples = whole(who, "samples in a window (window * sampling)", window * sampling, eigenvalue ? 8.0 : 2.0);
    rule.dead_zone = positive_parameter(who, values, "dead_zone", 0.0, true);
    rule.sliding = values.scalar("halving", 0.0) == 1.0;
    if (eigenvalue) {
      if (!values.has("xi")) throw ConfigError("protocol " + std::string(who) + ": reference eigenvalue needs the parameter xi (rad/s)");
      rule.xi = positive_parameter(who, values, "xi", {});
    }
    return rule;
  }

  static State start(std::string_view who, const Rule& rule, const Setup& setup, double c) {
    State s;
    s.kappa = positive_parameter(who, setup.initial, "kappa", c);
    if (rule.kind == Kind::eigenvalue) {
      for (const char* name : {"r", "q"})
        if (!setup.initial.has(name))
          throw ConfigError("protocol " + std::string(who) + ": agent " + std::to_string(setup.self.value) +
                            ": reference eigenvalue needs an initial " + name + ", for example {uniform: [-1, 1]}");
      s.r = setup.initial.scalar("r") < 0.0 ? -1.0 : 1.0;
      s.q = setup.initial.scalar("q") < 0.0 ? -1.0 : 1.0;
      s.z.reserve(rule.samples);
    }
    if (rule.kind == Kind::halving && rule.sliding) s.c.assign(rule.samples, c);
    return s;
  }

  /// Forgets what was seen of c (the network has changed) and begins again from kappa and c. The artificial states go on: Algorithm 4.2
  /// follows a change by itself (Remark 34), from a fresh window.
  static void restart(State& s, double c, double kappa) {
    s.kappa = kappa;
    s.rounds = 0;
    s.taken = 0;
    std::fill(s.c.begin(), s.c.end(), c);
    s.z.clear();
  }

  /// One round: `c` is c_i(k); `laplacian_r`, `laplacian_q` are sum_j w_ij (r_i - r_j) and the same of q.
  static void advance(const Rule& rule, State& s, Round k, double c, double laplacian_r, double laplacian_q) {
    if (rule.kind == Kind::fixed) return;
    if (s.rounds++ % rule.sample_rounds == 0) sample(rule, s, c);
    if (rule.kind != Kind::eigenvalue) return;
    // r_i' = -xi sum_j w_ij (q_i - q_j),  q_i' = xi sum_j w_ij (r_i - r_j)                                                    (4.87)
    const double step = 2.0 * rule.dt * rule.xi;
    if (k % 2 == 0)
      s.r -= step * laplacian_q;
    else
      s.q += step * laplacian_r;
  }

  /// Smallest positive frequency in samples z taken every `spacing` s, rad/s: of the line nearest to zero that stands out. None if there
  /// is none.
  static std::optional<double> smallest_frequency(const std::vector<std::complex<double>>& z, Seconds spacing) {
    constexpr std::size_t kPadding = 8;    // grid points per bin of the window
    constexpr double kVisible = 0.05;      // of the strongest line; the first side lobe of a Hann window is at 0.027
    constexpr double kConstantPart = 1.5;  // bins nearer to zero belong to the constant part
    const std::size_t n = z.size(), padded = kPadding * n;
    std::vector<double> hann(n);
    double weight = 0.0;
    std::complex<double> mean = 0.0;
    for (std::size_t i = 0; i < n; ++i) {
      hann[i] = 1.0 - std::cos(2.0 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(n));
      weight += hann[i];
      mean += hann[i] * z[i];
    }
    mean /= weight;
    std::vector<std::complex<double>> in(padded), spectrum;
    for (std::size_t i = 0; i < n; ++i) in[i] = hann[i] * (z[i] - mean);
    Eigen::FFT<double> fft;
    fft.fwd(spectrum, in);
    std::vector<double> power(padded / 2);
    for (std::size_t b = 0; b < power.size(); ++b) power[b] = std::norm(spectrum[b]);
    const auto first = static_cast<std::size_t>(kConstantPart * kPadding);
    const double visible = kVisible * kVisible * *std::max_element(power.begin() + static_cast<std::ptrdiff_t>(first), power.end());
    for (std::size_t b = first; b + 1 < power.size(); ++b) {
      if (power[b] < visible || power[b] <= power[b - 1] || power[b] < power[b + 1] || power[b + 1] <= 0.0) continue;
      // The top of the parabola through three points of the logarithm.
      const double left = std::log(power[b - 1]), middle = std::log(power[b]), right = std::log(power[b + 1]);
      const double shift = 0.5 * (left - right) / (left - 2.0 * middle + right);
      return 2.0 * std::numbers::pi * (static_cast<double>(b) + shift) / (static_cast<double>(padded) * spacing);
    }
    return std::nullopt;
  }

 private:
  static Round whole(std::string_view who, std::string_view what, double value, double least) {
    const double rounded = std::round(value);
    if (std::abs(value - rounded) > 1e-6 * rounded || rounded < least || rounded > 1e6)
      throw ConfigError("protocol " + std::string(who) + ": " + std::string(what) + " is " + number_text(value) +
                        "; allowed: a whole number from " + std::to_string(static_cast<int>(least)) + " to 1000000");
    return static_cast<Round>(rounded);
  }

  static void sample(const Rule& rule, State& s, double c) {
    if (rule.kind == Kind::eigenvalue) {
      s.z.emplace_back(s.r, s.q);
      if (s.z.size() < rule.samples) return;
      estimate_eigenvalue(rule, s);
      s.z.clear();
    } else if (rule.sliding) {
      s.c[s.taken++ % s.c.size()] = c;
      const auto [low, high] = std::minmax_element(s.c.begin(), s.c.end());
      settle(rule, s, *low, *high);
    } else {
      s.low = s.taken == 0 ? c : std::min(s.low, c);
      s.high = s.taken == 0 ? c : std::max(s.high, c);
      if (++s.taken < rule.samples) return;
      settle(rule, s, s.low, s.high);
      s.taken = 0;
    }
  }

  static void settle(const Rule& rule, State& s, double low, double high) {
    // kappa_i = (max(c_B) + min(c_B)) / 2                                                                          Algorithm 4.1, step 2
    const double kappa = 0.5 * (high + low);
    if (std::abs(kappa - s.kappa) > rule.dead_zone) s.kappa = kappa;
  }

  static void estimate_eigenvalue(const Rule& rule, State& s) {
    const std::optional<double> omega = smallest_frequency(s.z, rule.dt * rule.sample_rounds);
    if (!omega) return;
    const double step = 2.0 * rule.dt;  // a turn by omega * step per symplectic step: 2 sin(omega step / 2) = xi lambda step
    const double lambda = 2.0 * std::sin(0.5 * *omega * step) / (step * rule.xi);
    // kappa_i = 1 / (2 lambda_min>0(L))                                                                                          (4.88)
    if (lambda > 0.0) s.kappa = 0.5 / lambda;
  }
};

}  // namespace consort
