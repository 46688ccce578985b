#include "core/values.hpp"

#include "core/errors.hpp"
#include "core/math/shapes.hpp"

#include <algorithm>

namespace consort {

namespace {

std::string quoted(std::string_view name) { return "'" + std::string(name) + "'"; }

ConfigError absent(std::string_view name, const std::vector<Values::Entry>& entries) {
  std::string text = "value " + quoted(name) + " is required but was not given; given:";
  for (const auto& entry : entries) text += ' ' + entry.name;
  if (entries.empty()) text += " nothing";
  return ConfigError(text);
}

}  // namespace

Matrix expand_covariance(const Matrix& given, Eigen::Index n, std::string_view name, bool strictly) {
  Matrix full;
  if (given.rows() == n && given.cols() == n) {
    full = given;
  } else if (given.size() == 1) {
    full = given(0, 0) * Matrix::Identity(n, n);
  } else if (given.rows() == n && given.cols() == 1) {
    full = given.col(0).asDiagonal();
  } else {
    const std::string size = std::to_string(n);
    throw ConfigError("covariance " + quoted(name) + " is " + shape_of(given) + "; allowed: a scalar, " + size + " x 1 (diagonal) or " +
                      size + " x " + size);
  }
  return require_symmetric(full, n, "covariance " + quoted(name), strictly ? Definiteness::definite : Definiteness::semidefinite);
}

void Values::set(std::string_view name, Matrix value) {
  for (auto& entry : entries_) {
    if (entry.name == name) {
      entry.value = std::move(value);
      return;
    }
  }
  entries_.push_back({std::string(name), std::move(value)});
}

void Values::set(std::string_view name, double value) { set(name, Matrix::Constant(1, 1, value)); }

const Matrix* Values::find(std::string_view name) const {
  const auto it = std::find_if(entries_.begin(), entries_.end(), [name](const Entry& entry) { return entry.name == name; });
  return it == entries_.end() ? nullptr : &it->value;
}

double Values::scalar(std::string_view name, std::optional<double> fallback) const {
  const Matrix* value = find(name);
  if (value == nullptr) {
    if (fallback) return *fallback;
    throw absent(name, entries_);
  }
  if (value->size() != 1) throw ConfigError("value " + quoted(name) + " is " + shape_of(*value) + "; allowed: a scalar");
  return (*value)(0, 0);
}

Vector Values::vector(std::string_view name) const {
  const Matrix* value = find(name);
  if (value == nullptr) throw absent(name, entries_);
  if (value->cols() != 1 || value->rows() == 0) {
    throw ConfigError("value " + quoted(name) + " is " + shape_of(*value) + "; allowed: a vector n x 1 with n >= 1");
  }
  return value->col(0);
}

Matrix Values::covariance(std::string_view name, Eigen::Index n, std::optional<double> fallback, bool strictly) const {
  const Matrix* value = find(name);
  if (value != nullptr) return expand_covariance(*value, n, name, strictly);
  if (!fallback) throw absent(name, entries_);
  return expand_covariance(Matrix::Constant(1, 1, *fallback), n, name, strictly);
}

Values Values::overridden_by(const Values& other) const {
  Values merged = *this;
  for (const auto& entry : other.entries_) merged.set(entry.name, entry.value);
  return merged;
}

}  // namespace consort
