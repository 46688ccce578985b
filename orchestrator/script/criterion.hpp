#pragma once
/// One acceptance criterion: comparisons of arithmetic over metrics, joined by and, or, not. Read whole before anything runs, so that no
/// text means something else than it says.
///
///     criterion  = conjunction {("or" | "||") conjunction}
///     conjunction = negation {("and" | "&&") negation}
///     negation   = ("not" | "!") negation | comparison
///     comparison = sum {("<" | "<=" | ">" | ">=" | "==" | "!=") sum}          a < m < b: a < m and m < b
///     sum        = product {("+" | "-") product}
///     product    = factor {("*" | "/") factor}
///     factor     = ("-" | "+") factor | operand ["^" factor]
///     operand    = number | metric | function "(" sum {"," sum} ")" | "(" criterion ")"
///
/// A parenthesis holds a number or a truth value, whichever its place asks for. A chain runs in one direction (< and <=, > and >=, or ==).

#include "core/metrics/metrics.hpp"

#include <string>
#include <string_view>
#include <vector>

namespace consort {

class Criterion {
 public:
  /// Throws ConfigError naming the column of what cannot be read.
  explicit Criterion(std::string text);

  struct Named {
    std::string metric;
    std::size_t column;  ///< where it stands first, from 1
  };
  [[nodiscard]] const std::vector<Named>& names() const { return names_; }  ///< in order of appearance
  [[nodiscard]] const std::string& text() const { return text_; }

  struct Verdict {
    bool met = false;
    double value = 0.0;  ///< of the first comparison: the first side that names a metric; of a chain the first such one between two others
    std::string_view undefined = {};  ///< why it cannot be met: what something in it came to, "not a number" or "infinite"; else empty
  };
  /// A metric that is absent, no number or infinite, or a calculation that comes to that, meets nothing, whatever joins it: neither `or`
  /// nor `not` makes a criterion met by what is not known.
  [[nodiscard]] Verdict judge(const Metrics& metrics) const;

  enum class Comparison { less, at_most, greater, at_least, equal, unequal };
  enum class Operation { number, metric, negate, add, subtract, multiply, divide, power, call, compare, both, either, invert };
  /// Takes its operands off the stack and leaves its result there; truth values are 1 and 0.
  struct Step {
    Operation operation;
    double number = 0.0;
    std::size_t which = 0;  ///< metric: index into names; call: index into the functions; compare: index into chains
    std::size_t count = 0;  ///< call: arguments
  };
  struct Chain {
    std::vector<Comparison> comparisons;  ///< between neighbours of one side more
    std::size_t shown = 0;                ///< the side whose value is shown
  };

 private:
  std::string text_;
  std::vector<Named> names_;
  std::vector<Chain> chains_;
  std::vector<Step> steps_;  // the text in postfix order
};

/// The functions a criterion may call.
std::vector<std::string> criterion_functions();

}  // namespace consort
