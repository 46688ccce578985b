#include "protocols/filters/estimator_network.hpp"

#include "core/math/decompositions.hpp"
#include "core/math/discretise.hpp"
#include "core/math/riccati.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>
#include <cmath>
#include <string>

namespace consort {

namespace {

// C with C'C = U.
Matrix square_root(const Matrix& U) {
  const auto [values, vectors] = symmetric_eigen(U);
  return values.cwiseMax(0.0).cwiseSqrt().asDiagonal() * vectors.transpose();
}

}  // namespace

Sensor sensor(const Matrix& C, const Matrix& R) {
  if (C.rows() == 0) return {Matrix::Zero(C.cols(), 0), Matrix::Zero(C.cols(), C.cols())};
  require_columns(C, C.cols(), "sensor: C");
  const Matrix definite = require_symmetric(R, C.rows(), "sensor: R", Definiteness::definite);
  const Matrix weighted = definite.llt().solve(C);  // R^-1 C
  const Matrix U = C.transpose() * weighted;
  return {weighted.transpose(), 0.5 * (U + U.transpose())};
}

Vector corrected_by(const Vector& u, const Matrix& U, const Matrix& P, const Vector& z, Seconds h) {
  const Eigen::Index n = z.size();
  const Vector news = h * (u - U * z);
  return solve(Matrix::Identity(n, n) + h * P * U, Vector(P * news), "I + h P_i U_i");
}

Matrix coupling_step(const Matrix& F, double d, Seconds h) {
  // (I - exp(-F d h)) / d = integral over 0..h of exp(-F d s) ds F, in which nothing cancels
  return discretise(-d * F, F, {}, h).B;
}

Matrix coupling_step(const Matrix& P, double gamma, double d, Seconds h) {
  const SymmetricEigen eigen = symmetric_eigen(P);
  const auto along = eigen.values.unaryExpr([&](double lambda) { return -std::expm1(-gamma * lambda * d * h) / d; });
  return eigen.vectors * along.asDiagonal() * eigen.vectors.transpose();
}

Matrix stationary_covariance(const Matrix& A, const Matrix& U, const Matrix& Q) {
  return filter_riccati(A, square_root(U), Q, Matrix::Identity(A.rows(), A.rows())).P;
}

std::vector<Matrix> coupled_covariances(const Matrix& A, const std::vector<CoupledFilter>& filters, const Graph& graph) {
  constexpr int kSweeps = 20'000;
  constexpr double kSettled = 1e-13;
  const Eigen::Index n = A.rows();
  std::vector<Matrix> P(filters.size(), Matrix::Zero(n, n));
  double change = 0.0, size = 0.0;
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    change = size = 0.0;
    for (std::size_t i = 0; i < filters.size(); ++i) {
      double d = 0.0;
      Matrix noise = filters[i].Q;  // (3.7c) as an equation of its own: A - (k d / 2) I, with this process noise
      for (const Neighbour& j : graph.in_neighbours(agent_at(i))) {
        d += j.weight;
        noise += filters[i].k * j.weight * P[index_of(j.id)];
      }
      const Matrix next = stationary_covariance(A - 0.5 * filters[i].k * d * Matrix::Identity(n, n), filters[i].U, noise);
      change = std::max(change, (next - P[i]).norm());
      size = std::max(size, next.norm());
      P[i] = next;
    }
    if (change <= kSettled * size) return P;
  }
  throw RunError("stationary covariances of " + std::to_string(filters.size()) + " coupled filters: after " + std::to_string(kSweeps) +
                 " sweeps they still change by " + text_of(change) + " of " + text_of(size));
}

Matrix stationary_update(const Matrix& A, const Matrix& S, const Matrix& Q) {
  constexpr int kRounds = 100'000;
  constexpr double kSettled = 1e-13;
  const Matrix I = Matrix::Identity(A.rows(), A.rows());
  Matrix P = I;
  for (int k = 0; k < kRounds; ++k) {
    const Matrix M = solve(I + P * S, P, "I + P S");
    const Matrix next = A * M * A.transpose() + Q;
    const double change = (next - P).norm();
    P = 0.5 * (next + next.transpose());
    if (std::isfinite(P.norm()) && change <= kSettled * P.norm()) return 0.5 * (M + M.transpose());
  }
  throw RunError("the covariance of Algorithm 3.1 (" + shape_of(A) + ") does not settle in " + std::to_string(kRounds) + " rounds");
}

Matrix EstimatorNetwork::error_matrix(const Graph& graph) const {
  const Eigen::Index n = A.rows(), N = static_cast<Eigen::Index>(injection.size());
  const Matrix L = laplacian(graph);
  Matrix R = Matrix::Zero(N * n, N * n);
  for (Eigen::Index i = 0; i < N; ++i) {
    const auto agent = static_cast<std::size_t>(i);
    R.block(i * n, i * n, n, n) = A - injection[agent];
    for (Eigen::Index j = 0; j < N; ++j) R.block(i * n, j * n, n, n) -= L(i, j) * coupling[agent];
  }
  return R;
}

Matrix EstimatorNetwork::sampled_error_matrix(const Graph& graph, Seconds h) const {
  const Eigen::Index n = A.rows(), N = static_cast<Eigen::Index>(injection.size());
  const Matrix L = laplacian(graph), I = Matrix::Identity(n, n), step = matrix_exponential(A, h);
  Matrix E = Matrix::Zero(N * n, N * n);
  for (Eigen::Index i = 0; i < N; ++i) {
    const auto agent = static_cast<std::size_t>(i);
    // I - (I + h K C)^-1 h K C = (I + h K C)^-1
    E.block(i * n, i * n, n, n) = step * inverse(I + h * injection[agent], "I + h G C of agent " + std::to_string(i + 1));
    if (L(i, i) == 0.0) continue;
    const Matrix S = step * coupling_step(coupling[agent], L(i, i), h);
    for (Eigen::Index j = 0; j < N; ++j) E.block(i * n, j * n, n, n) -= L(i, j) * S;
  }
  return E;
}

Matrix iterative_error_matrix(const Matrix& A, const std::vector<IterativeFilter>& filters, const Graph& graph) {
  const Eigen::Index n = A.rows(), N = static_cast<Eigen::Index>(filters.size());
  const Matrix L = laplacian(graph), I = Matrix::Identity(n, n);
  Matrix E = Matrix::Zero(N * n, N * n);
  for (Eigen::Index i = 0; i < N; ++i) {
    const auto& [S, M, epsilon] = filters[static_cast<std::size_t>(i)];
    E.block(i * n, i * n, n, n) = A * (I - M * S);
    for (Eigen::Index j = 0; j < N; ++j) E.block(i * n, j * n, n, n) -= L(i, j) * epsilon * A * M;
  }
  return E;
}

}  // namespace consort
