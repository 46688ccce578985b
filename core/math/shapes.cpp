#include "core/math/shapes.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"

#include <cmath>
#include <sstream>

namespace consort {

namespace {

void require(const Matrix& value, bool fits, std::string_view what, const std::string& allowed) {
  if (!fits) throw ConfigError(std::string(what) + " is " + shape_of(value) + "; allowed: " + allowed);
  if (!value.allFinite()) throw ConfigError(std::string(what) + " has an entry that is not finite");
}

}  // namespace

std::string text_of(double value) {
  std::ostringstream text;
  text << value;
  return text.str();
}

std::string text_of(std::complex<double> value) {
  if (value.imag() == 0.0) return text_of(value.real());
  return text_of(value.real()) + (value.imag() < 0.0 ? " - " : " + ") + text_of(std::abs(value.imag())) + "i";
}

std::string text_of(const Vector& value) {
  if (value.size() == 1) return text_of(value[0]);
  std::string out;
  for (const double component : value) out += (out.empty() ? "" : ", ") + text_of(component);
  return "(" + out + ")";
}

std::string shape_of(const Matrix& value) { return std::to_string(value.rows()) + " x " + std::to_string(value.cols()); }

void require_square(const Matrix& value, std::string_view what) {
  require(value, value.rows() == value.cols() && value.rows() > 0, what, "n x n with n >= 1");
}

void require_rows(const Matrix& value, Eigen::Index rows, std::string_view what) {
  require(value, value.rows() == rows && value.cols() > 0, what, std::to_string(rows) + " x m with m >= 1");
}

void require_columns(const Matrix& value, Eigen::Index cols, std::string_view what) {
  require(value, value.cols() == cols && value.rows() > 0, what, "p x " + std::to_string(cols) + " with p >= 1");
}

Matrix require_symmetric(const Matrix& value, Eigen::Index n, std::string_view what, Definiteness definiteness) {
  const std::string size = std::to_string(n);
  require(value, value.rows() == n && value.cols() == n, what, size + " x " + size);
  if (n == 0) return value;
  const double scale = value.cwiseAbs().maxCoeff();
  const double asymmetry = (value - value.transpose()).cwiseAbs().maxCoeff();
  if (asymmetry > 1e-12 * scale)
    throw ConfigError(std::string(what) + " is not symmetric: largest difference to its transpose " + text_of(asymmetry));
  Matrix symmetric = 0.5 * (value + value.transpose());
  if (definiteness == Definiteness::any) return symmetric;
  const bool strictly = definiteness == Definiteness::definite;
  const double smallest = symmetric_eigenvalues(symmetric)(0);
  // A singular matrix may come out with an eigenvalue of the size of the rounding error, on either side of zero.
  const double rounding = 1e-12 * scale * static_cast<double>(n);
  if (strictly ? smallest <= (n == 1 ? 0.0 : rounding) : smallest < -rounding)
    throw ConfigError(std::string(what) + " has the eigenvalue " + text_of(smallest) +
                      "; allowed: " + (strictly ? "positive definite" : "positive semidefinite"));
  return symmetric;
}

}  // namespace consort
