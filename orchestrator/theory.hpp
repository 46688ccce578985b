#pragma once
/// What theory says of an experiment before anything starts.

#include "core/experiment.hpp"

#include <string>
#include <vector>

namespace consort {

constexpr std::size_t kLargestSpectrum = 300;  ///< agents up to which eigenvalues are worth the wait
constexpr std::size_t kMostGraphs = 20;        ///< different graphs of one run whose eigenvalues are

enum class Rating {
  holds,
  fails,    ///< worth a warning
  refused,  ///< fails, and without it the run makes no sense: it is not started, unless the user insists
  note
};

struct Finding {
  Rating verdict = Rating::note;
  std::string condition;    ///< e.g. "strongly connected in every round"
  std::string evidence;     ///< e.g. "30 of 30 distinct graphs", or the first round where it fails
  std::string consequence;  ///< e.g. "MDKC converges to the centralised estimate (Alighanbari, How 2006, Theorem 7)"
};

/// Connectivity, balance, spanning tree over windows, and what follows for each protocol of the experiment.
std::vector<Finding> examine(const Experiment& experiment);

}  // namespace consort
