#include "orchestrator/script/criterion.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/criterion_reader.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

namespace consort {
namespace {

using Comparison = Criterion::Comparison;
using Operation = Criterion::Operation;

bool holds(Comparison comparison, double left, double right) {
  switch (comparison) {
    case Comparison::less:
      return left < right;
    case Comparison::at_most:
      return left <= right;
    case Comparison::greater:
      return left > right;
    case Comparison::at_least:
      return left >= right;
    case Comparison::equal:
      return left == right;
    case Comparison::unequal:
      break;
  }
  return left != right;
}

// The stack on which a criterion is worked out.
class Stack {
 public:
  void push(double value) { values_.push_back(value); }
  double pop() {
    const double top = values_.back();
    values_.pop_back();
    return top;
  }
  // The last `count`, taken off.
  std::vector<double> pop(std::size_t count) {
    std::vector<double> top(values_.end() - static_cast<std::ptrdiff_t>(count), values_.end());
    values_.resize(values_.size() - count);
    return top;
  }
  [[nodiscard]] double top() const { return values_.back(); }

 private:
  std::vector<double> values_;
};

bool all_hold(const Criterion::Chain& chain, const std::vector<double>& sides) {
  for (std::size_t i = 0; i < chain.comparisons.size(); ++i)
    if (!holds(chain.comparisons[i], sides[i], sides[i + 1])) return false;
  return true;
}

// What two operands make.
double combined(Operation operation, double left, double right) {
  switch (operation) {
    case Operation::add:
      return left + right;
    case Operation::subtract:
      return left - right;
    case Operation::multiply:
      return left * right;
    case Operation::divide:
      return left / right;
    case Operation::power:
      return std::pow(left, right);
    case Operation::both:
      return left != 0.0 && right != 0.0 ? 1.0 : 0.0;
    case Operation::either:
      return left != 0.0 || right != 0.0 ? 1.0 : 0.0;
    default:
      break;
  }
  check(false, "an operation of two operands");
  return 0.0;
}

}  // namespace

Criterion::Criterion(std::string text) : text_(std::move(text)) { read_criterion(text_, names_, chains_, steps_); }

Criterion::Verdict Criterion::judge(const Metrics& metrics) const {
  Stack stack;
  std::optional<double> shown;
  std::string_view undefined;
  for (const Step& step : steps_) {
    switch (step.operation) {
      case Operation::number:
        stack.push(step.number);
        break;
      case Operation::metric: {
        const auto found = metrics.find(names_[step.which].metric);
        stack.push(found == metrics.end() ? std::numeric_limits<double>::quiet_NaN() : found->second);
        break;
      }
      case Operation::negate:
        stack.push(-stack.pop());
        break;
      case Operation::invert:
        stack.push(stack.pop() == 0.0 ? 1.0 : 0.0);
        break;
      case Operation::call:
        stack.push(criterion_function_table()[step.which].value(stack.pop(step.count)));
        break;
      case Operation::compare: {
        const Chain& chain = chains_[step.which];
        const auto sides = stack.pop(chain.comparisons.size() + 1);
        if (!shown) shown = sides[chain.shown];
        stack.push(all_hold(chain, sides) ? 1.0 : 0.0);
        break;
      }
      default: {
        const double right = stack.pop(), left = stack.pop();
        stack.push(combined(step.operation, left, right));
      }
    }
    if (undefined.empty() && !std::isfinite(stack.top())) undefined = std::isnan(stack.top()) ? "not a number" : "infinite";
  }
  return {undefined.empty() && stack.pop() != 0.0, shown.value_or(std::numeric_limits<double>::quiet_NaN()), undefined};
}

}  // namespace consort
