#include "core/math/spd.hpp"

#include "core/errors.hpp"
#include "core/math/decompositions.hpp"

#include <cmath>
#include <sstream>

namespace consort {

void refuse_matrix(const Place& place, std::string_view matrix, const Matrix& value) {
  std::ostringstream text;
  text << place.algorithm << ": agent " << place.agent.value << ", round " << place.k << ": matrix " << matrix << " (" << value.rows()
       << " x " << value.cols() << ") is not numerically positive definite";
  if (value.allFinite()) {
    const Vector eigenvalues = symmetric_eigenvalues(value);
    const double smallest = eigenvalues.minCoeff(), largest = eigenvalues.cwiseAbs().maxCoeff();
    text << ": eigenvalues in [" << smallest << ", " << eigenvalues.maxCoeff() << "], condition " << largest / std::abs(smallest);
  } else {
    text << ": it has entries that are not finite, condition infinite";
  }
  throw RunError(text.str());
}

}  // namespace consort
