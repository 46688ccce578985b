#pragma once
/// One round of each protocol as a bare loop: the arithmetic of protocols/ for two in-neighbours and the default parameters (or those
/// that protocol_bench.cpp gives), with numbers read and written where the contract has them, and nothing else.

#include "protocols/protocol.hpp"

#include <array>
#include <cmath>
#include <stdexcept>

namespace consort::bare {

inline constexpr Seconds kStep = 1e-3;
inline constexpr double kRoot3 = 1.7320508075688772;

struct Given {
  std::span<const double> y;
  std::span<const Neighbour> neighbours;
  Inbox inbox;
};
struct Wanted {
  std::span<double> message, u, estimate;
};

using In = Eigen::Map<const Vector>;
using Out = Eigen::Map<Vector>;
inline In in(std::span<const double> numbers) { return {numbers.data(), static_cast<Eigen::Index>(numbers.size())}; }
inline Out out(std::span<double> numbers) { return {numbers.data(), static_cast<Eigen::Index>(numbers.size())}; }
inline void require_finite(const Wanted& wanted) {
  if (!out(wanted.estimate).allFinite() || !out(wanted.u).allFinite()) throw std::runtime_error("no longer finite");
}

// --- sizes known to the compiler ------------------------------------------------------------------------------------------

using Vec = Eigen::Vector2d;
using Mat = Eigen::Matrix2d;
inline Eigen::Map<const Vec> vec(const double* numbers) { return Eigen::Map<const Vec>(numbers); }
inline Eigen::Map<const Mat> mat(const double* numbers) { return Eigen::Map<const Mat>(numbers); }
inline void write(const Vec& value, std::span<double> to) { Eigen::Map<Vec>(to.data()) = value; }

class LocalVoting {
 public:
  void round(const Given& given, const Wanted& wanted) {
    write(x_, wanted.message);
    Vec sum = Vec::Zero();
    for (const Received& j : given.inbox) sum += j.weight * (vec(j.payload.data()) - x_);
    x_ += kStep * sum;
    write(x_, wanted.estimate);
    if (!x_.allFinite()) throw std::runtime_error("no longer finite");
  }

 private:
  Vec x_ = Vec::Constant(0.5);
};

struct SteeringVoting {
  void round(const Given& given, const Wanted& wanted) {
    const Vec x = vec(given.y.data());
    write(x, wanted.message);
    Vec u = Vec::Zero();
    for (const Received& j : given.inbox) u += j.weight * (vec(j.payload.data()) - x);
    write(u, wanted.u);
    write(x, wanted.estimate);
    if (!u.allFinite() || !x.allFinite()) throw std::runtime_error("no longer finite");
  }
};

/// Through LLT, which refuses what is not positive definite.
inline Mat inverse(const Mat& a) {
  const Eigen::LLT<Mat> factor(a);
  if (factor.info() != Eigen::Success) throw std::runtime_error("not positive definite");
  Mat lower = Mat::Identity();
  factor.matrixL().solveInPlace(lower);
  return lower.transpose() * lower;
}

/// x and its covariance (or its inverse), as they are sent.
class Estimator {
 protected:
  void emit(const Wanted& wanted) const {
    write(x_, wanted.message);
    Eigen::Map<Mat>(wanted.message.data() + 2) = P_;
  }
  void tell(const Wanted& wanted) const {
    write(x_, wanted.estimate);
    if (!x_.allFinite()) throw std::runtime_error("no longer finite");
  }
  Vec x_ = Vec::Constant(0.5);
  Mat P_ = Mat::Identity();
  const Mat Q_ = 0.1 * Mat::Identity(), Omega_ = 0.1 * Mat::Identity();
};

struct Kalman : private Estimator {
  void round(const Given& given, const Wanted& wanted) {
    emit(wanted);
    Mat information = inverse(P_ + Q_);
    Vec innovation = Vec::Zero();
    for (const Received& j : given.inbox) {
      const Mat certainty = inverse(mat(j.payload.data() + 2) + Omega_);
      information += j.weight * certainty;
      innovation += certainty * (j.weight * (vec(j.payload.data()) - x_));
    }
    P_ = inverse(information);
    x_ += P_ * innovation;
    tell(wanted);
  }
};

struct UnbiasedKalman : private Estimator {
  void round(const Given& given, const Wanted& wanted) {
    emit(wanted);
    wanted.message[6] = static_cast<double>(given.neighbours.size());
    Mat information = inverse(P_ + Q_);
    Vec innovation = Vec::Zero();
    for (const Received& j : given.inbox) {
      const Mat certainty = inverse(j.payload[6] * mat(j.payload.data() + 2) + Omega_);
      information += certainty;
      innovation += certainty * (vec(j.payload.data()) - x_);
    }
    P_ = inverse(information);
    x_ += P_ * innovation;
    tell(wanted);
  }
};

struct UnbiasedInformation : private Estimator {
  void round(const Given& given, const Wanted& wanted) {
    emit(wanted);
    wanted.message[6] = static_cast<double>(given.neighbours.size());
    Vec y = 0.5 * P_ * x_;
    P_ *= 0.5;
    for (const Received& j : given.inbox) {
      const double share = 0.5 / j.payload[6];
      P_ += share * mat(j.payload.data() + 2);
      y += share * (mat(j.payload.data() + 2) * vec(j.payload.data()));
    }
    x_ = inverse(P_) * y;
    tell(wanted);
  }
};

/// Running sums of both in-neighbours, which grow from round to round.
struct RobustInformation : private Estimator {
  void round(const Given& given, const Wanted& wanted) {
    const double share = 1.0 / (1.0 + static_cast<double>(given.neighbours.size()));
    P_ *= share;
    y_ *= share;
    P_sum_ += P_;
    y_sum_ += y_;
    Eigen::Map<Mat>(wanted.message.data()) = P_sum_;
    write(y_sum_, wanted.message.subspan(4));
    Eigen::Map<Mat>(wanted.message.data() + 6) = P_;
    write(y_, wanted.message.subspan(10));
    wanted.message[12] = 0.0;
    for (std::size_t j = 0; j < given.inbox.size(); ++j) {
      const double* heard = given.inbox[j].payload.data();
      P_ += mat(heard) - P_heard_[j];
      y_ += vec(heard + 4) - y_heard_[j];
      P_heard_[j] = mat(heard);
      y_heard_[j] = vec(heard + 4);
    }
    x_ = inverse(P_) * y_;
    tell(wanted);
  }

 private:
  Vec y_ = x_, y_sum_ = Vec::Zero();
  Mat P_sum_ = Mat::Zero();
  std::array<Mat, 2> P_heard_{Mat::Zero(), Mat::Zero()};
  std::array<Vec, 2> y_heard_{Vec::Zero(), Vec::Zero()};
};

struct ContinuousKalman : private Estimator {
  void round(const Given& given, const Wanted& wanted) {
    emit(wanted);
    Mat certainty = Mat::Zero();
    Vec pull = Vec::Zero();
    for (const Received& j : given.inbox) {
      const Mat of_j = inverse(mat(j.payload.data() + 2) + Omega_);
      certainty += j.weight * of_j;
      pull += of_j * (j.weight * (vec(j.payload.data()) - x_));
    }
    const auto slope_x = [&](const Vec& x, const Mat& P) -> Vec { return P * (pull - certainty * x); };
    const auto slope_P = [&](const Mat& P) -> Mat { return Q_ - P * certainty * P; };
    const Vec moved = Vec::Zero(), x1 = slope_x(moved, P_);
    const Mat P1 = slope_P(P_), P_b = P_ + 0.5 * kStep * P1;
    const Vec x2 = slope_x(0.5 * kStep * x1, P_b);
    const Mat P2 = slope_P(P_b), P_c = P_ + 0.5 * kStep * P2;
    const Vec x3 = slope_x(0.5 * kStep * x2, P_c);
    const Mat P3 = slope_P(P_c), P_d = P_ + kStep * P3;
    const Vec x4 = slope_x(kStep * x3, P_d);
    const Mat P4 = slope_P(P_d);
    x_ += kStep / 6.0 * (x1 + 2.0 * x2 + 2.0 * x3 + x4);
    P_ += kStep / 6.0 * (P1 + 2.0 * P2 + 2.0 * P3 + P4);
    if (Eigen::LLT<Mat>(P_).info() != Eigen::Success) throw std::runtime_error("not positive definite");
    P_ = (0.5 * (P_ + P_.transpose())).eval();
    tell(wanted);
  }
};

struct Das {
  void round(const Given& given, const Wanted& wanted) {
    const double x = given.y[0];
    wanted.message[0] = x;
    double e = 0.0, in_degree = 0.0;
    for (const Received& j : given.inbox) e += j.weight * (j.payload[0] - x);
    for (const Neighbour& neighbour : given.neighbours) in_degree += neighbour.weight;
    const Eigen::Vector3d phi(1.0, std::sin(x), std::cos(x));
    wanted.u[0] = 20.0 * e - W.dot(phi);
    W = kept * W - (learnt * 10.0 * e * in_degree) * phi;
    Eigen::Map<Eigen::Vector3d>(wanted.estimate.data()) = W;
    if (!W.allFinite() || !std::isfinite(wanted.u[0])) throw std::runtime_error("no longer finite");
  }
  Eigen::Vector3d W = Eigen::Vector3d::Zero();
  const double kept = std::exp(-0.1 * kStep), learnt = -std::expm1(-0.1 * kStep) / 0.1;
};

// --- sizes known when the run begins ------------------------------------------------------------------------------------------

/// Gains of a double integrator, and room for sums.
struct Linear {
  const Matrix K = (Matrix(1, 2) << 1, kRoot3).finished(), P = (Matrix(2, 2) << kRoot3, 1, 1, kRoot3).finished();
  Vector difference = Vector::Zero(2), sum = Vector::Zero(2);
};

struct Static : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In x = in(given.y);
    out(wanted.message) = x;
    sum.setZero();
    for (const Received& j : given.inbox) sum += j.weight * (in(j.payload) - x);
    out(wanted.u).noalias() = K * sum;
    out(wanted.estimate) = x;
    require_finite(wanted);
  }
};

struct Measured {
  void round(const Given& given, const Wanted& wanted) {
    const std::size_t n = wanted.u.size();
    const In x = in(given.y.first(n));
    out(wanted.message) = x;
    Out u = out(wanted.u);
    u.setZero();
    for (const Received& j : given.inbox) u += j.weight * (in(given.y.subspan(index_of(j.from) * n, n)) - x);
    out(wanted.estimate) = x;
    require_finite(wanted);
  }
};

struct MinimumEnergy {
  void round(const Given& given, const Wanted& wanted) {
    const std::size_t n = wanted.u.size();
    out(wanted.message) = x;
    double d = 0.0;
    for (const Neighbour& j : given.neighbours) d += j.weight;
    surprise.setZero();
    for (const Received& j : given.inbox) surprise += j.weight * (in(given.y.subspan(index_of(j.from) * n, n)) - x);
    const double Q = 1.0 / std::sqrt(1.0 + d / 2.0);
    Out u = out(wanted.u);
    u = 0.5 * surprise;
    x += kStep * (u + Q * (in(given.y.first(n)) - x + 0.5 * surprise));
    out(wanted.estimate.first(n)) = x;
    wanted.estimate[n] = Q;
    require_finite(wanted);
  }
  Vector x = Vector::Constant(2, 0.5), surprise = Vector::Zero(2);
};

/// Its reference is fixed; what finds another one travels all the same.
struct Adaptive : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In y = in(given.y);
    const std::size_t n = given.y.size();
    out(wanted.message.first(n)) = y;
    wanted.message[n] = changed;
    wanted.message[n + 1] = r;
    wanted.message[n + 2] = q;
    sum.setZero();
    double disagreement = 0.0, laplacian_r = 0.0, laplacian_q = 0.0, newest = changed;
    for (const Received& j : given.inbox) {
      newest = std::max(newest, j.payload[n]);
      difference = in(j.payload.first(n)) - y;
      sum += j.weight * difference;
      disagreement += j.weight * K.lazyProduct(difference).squaredNorm();
      laplacian_r += j.weight * (r - j.payload[n + 1]);
      laplacian_q += j.weight * (q - j.payload[n + 2]);
    }
    if (newest > changed || laplacian_r != laplacian_r || laplacian_q != laplacian_q) c = kappa;
    out(wanted.u) = c * K.lazyProduct(sum);
    c += decayed * (disagreement - 0.66 * (c - kappa));
    wanted.estimate[0] = c;
    wanted.estimate[1] = kappa;
    require_finite(wanted);
  }
  double c = 0.01, kappa = 0.01, r = 1.0, q = 1.0, changed = 0.0;
  const double decayed = -std::expm1(-0.66 * kStep) / 0.66;
};

struct Su : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In y = in(given.y);
    const std::size_t n = given.y.size(), d = n / 2;
    out(wanted.message.first(n)) = y;
    wanted.message[n] = given.neighbours.empty() ? 1.0 : 0.0;
    Out u = out(wanted.u);
    u.setZero();
    for (std::size_t j = 0; j < given.inbox.size(); ++j) {
      const auto& [from, sent, w, payload] = given.inbox[j];
      difference = y - in(payload.first(n));
      const auto to_p = difference.head(static_cast<Eigen::Index>(d)), to_v = difference.tail(static_cast<Eigen::Index>(d));
      if (payload[n] != 0.0) {
        u -= w * (to_p + c * to_v);
        c += kStep * to_v.squaredNorm();
      } else {
        u -= w * (to_p + m[j] * to_v);
        m[j] += kStep * to_v.squaredNorm();
      }
    }
    wanted.estimate[0] = c;
    wanted.estimate[1] = std::max(m[0], m[1]);
    require_finite(wanted);
  }
  double c = 0.01;
  std::array<double, 2> m{0.01, 0.01};
};

struct Yu : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In y = in(given.y);
    const auto d = static_cast<Eigen::Index>(given.y.size() / 2);
    out(wanted.message) = y;
    sum.setZero();
    for (const Received& j : given.inbox) sum += j.weight * (y - in(j.payload));
    const auto e_p = sum.head(d), e_v = sum.tail(d);
    out(wanted.u) = -c * (e_p + e_v);
    c += kStep * 0.1 * (e_p.squaredNorm() + e_v.squaredNorm() + 2.0 * e_p.dot(e_v));
    wanted.estimate[0] = c;
    require_finite(wanted);
  }
  double c = 0.1;
};

struct LiEdge : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In y = in(given.y);
    out(wanted.message) = y;
    sum.setZero();
    for (std::size_t j = 0; j < given.inbox.size(); ++j) {
      const double w = given.inbox[j].weight;
      difference = in(given.inbox[j].payload) - y;
      sum += (c[j] * w) * difference;
      c[j] += kStep * w * K.lazyProduct(difference).squaredNorm();
    }
    out(wanted.u) = K.lazyProduct(sum);
    wanted.estimate[0] = std::min(c[0], c[1]);
    wanted.estimate[1] = (c[0] + c[1]) / 2.0;
    wanted.estimate[2] = std::max(c[0], c[1]);
    require_finite(wanted);
  }
  std::array<double, 2> c{0.01, 0.01};
};

struct LiAgent : private Linear {
  void round(const Given& given, const Wanted& wanted) {
    const In y = in(given.y);
    out(wanted.message) = y;
    sum.setZero();
    for (const Received& j : given.inbox) sum += j.weight * (y - in(j.payload));
    const double root = 1.0 + sum.dot(P.lazyProduct(sum));
    out(wanted.u) = (-c * root * root * root) * K.lazyProduct(sum);
    c += kStep * K.lazyProduct(sum).squaredNorm();
    wanted.estimate[0] = c;
    require_finite(wanted);
  }
  double c = 1.0;
};

}  // namespace consort::bare
