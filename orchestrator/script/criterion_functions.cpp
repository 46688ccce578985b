#include "orchestrator/script/criterion_reader.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace consort {
namespace {

constexpr std::array kFunctions{
    CriterionFunction{"abs", false, [](std::span<const double> x) { return std::abs(x[0]); }},
    CriterionFunction{"sqrt", false, [](std::span<const double> x) { return std::sqrt(x[0]); }},
    CriterionFunction{"exp", false, [](std::span<const double> x) { return std::exp(x[0]); }},
    CriterionFunction{"ln", false, [](std::span<const double> x) { return std::log(x[0]); }},
    CriterionFunction{"log10", false, [](std::span<const double> x) { return std::log10(x[0]); }},
    CriterionFunction{"min", true, [](std::span<const double> x) { return *std::min_element(x.begin(), x.end()); }},
    CriterionFunction{"max", true, [](std::span<const double> x) { return *std::max_element(x.begin(), x.end()); }},
};

}  // namespace

std::span<const CriterionFunction> criterion_function_table() { return kFunctions; }

std::vector<std::string> criterion_functions() {
  std::vector<std::string> names;
  for (const CriterionFunction& function : kFunctions) names.emplace_back(function.name);
  return names;
}

}  // namespace consort
