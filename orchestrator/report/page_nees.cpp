#include "orchestrator/report/page_nees.hpp"

#include "core/types.hpp"

#include <Eigen/Cholesky>
#include <boost/math/distributions/chi_squared.hpp>

#include <limits>

namespace consort {

double nees(std::span<const double> error, std::span<const double> covariance) {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN(), kLeastVariance = 1e-290;
  const auto n = static_cast<Eigen::Index>(error.size());
  const Eigen::Map<const Vector> e(error.data(), n);
  const Eigen::Map<const Matrix> p(covariance.data(), n, n);
  if (!p.allFinite() || !e.allFinite() || p.diagonal().minCoeff() < kLeastVariance) return kNothing;
  const Eigen::LLT<Matrix> factor(p);
  if (factor.info() != Eigen::Success) return kNothing;
  return factor.matrixL().solve(e).squaredNorm();
}

std::pair<double, double> nees_band(std::size_t n) {
  const boost::math::chi_squared distribution(static_cast<double>(n));
  return {boost::math::quantile(distribution, 0.025), boost::math::quantile(distribution, 0.975)};
}

}  // namespace consort
