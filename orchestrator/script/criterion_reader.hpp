#pragma once
/// From the text of a criterion to its steps, and the functions it may call.

#include "orchestrator/script/criterion.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consort {

struct CriterionFunction {
  std::string_view name;
  bool takes_several;
  double (*value)(std::span<const double>);
};
/// Steps name them by their index.
std::span<const CriterionFunction> criterion_function_table();

/// Reads `text` into steps in postfix order. Throws ConfigError naming the column of what cannot be read.
void read_criterion(const std::string& text, std::vector<Criterion::Named>& names, std::vector<Criterion::Chain>& chains,
                    std::vector<Criterion::Step>& steps);

}  // namespace consort
