#include "orchestrator/script/criterion_reader.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/criterion_text.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

namespace consort {
namespace {

using Comparison = Criterion::Comparison;
using Operation = Criterion::Operation;

constexpr std::size_t kDeepest = 200;

// The way a chain runs; none for !=, which says nothing of the outer two.
int direction(Comparison comparison) {
  switch (comparison) {
    case Comparison::less:
    case Comparison::at_most:
      return 1;
    case Comparison::greater:
    case Comparison::at_least:
      return 2;
    case Comparison::equal:
      return 3;
    case Comparison::unequal:
      break;
  }
  return 0;
}

// The side of a chain whose value is worth showing, from which of them name a metric: the first that others enclose, or else the first.
std::size_t shown_side(const std::vector<bool>& names_metric) {
  const auto inner = std::find(names_metric.begin() + 1, names_metric.end() - 1, true);
  const auto found = inner != names_metric.end() - 1 ? inner : std::find(names_metric.begin(), names_metric.end(), true);
  return static_cast<std::size_t>(found - names_metric.begin());
}

// Reads a text into steps in postfix order.
class Reader : private CriterionText {
 public:
  Reader(const std::string& text, std::vector<Criterion::Named>& names, std::vector<Criterion::Chain>& chains,
         std::vector<Criterion::Step>& steps)
      : CriterionText(text), names_(names), chains_(chains), steps_(steps) {}

  void read() {
    const Part whole = criterion();
    skip_space();
    if (at_ < text_.size()) unexpected("the end or an operator");
    if (!whole.truth) refuse(whole.begin, "no comparison");
  }

 private:
  struct Part {
    bool truth;  // a truth value, not a number
    std::size_t begin;
    bool names_metric;
  };

  // Counts how deep parentheses, signs and powers are nested, because each is a call of this reader.
  class Deeper {
   public:
    explicit Deeper(Reader& reader) : reader_(reader) {
      if (++reader_.depth_ > kDeepest) reader_.refuse(reader_.at_, "nested too deeply");
    }
    ~Deeper() { --reader_.depth_; }
    Deeper(const Deeper&) = delete;
    Deeper& operator=(const Deeper&) = delete;

   private:
    Reader& reader_;
  };

  void needs_truth(const Part& part, std::string_view joint) const {
    if (!part.truth) refuse(part.begin, fmt::format("no comparison where '{}' asks for one", joint));
  }
  void needs_number(const Part& part, std::string_view place) const {
    if (part.truth) refuse(part.begin, fmt::format("a comparison where {} asks for a number", place));
  }

  void step(Operation operation, std::size_t which = 0, std::size_t count = 0) { steps_.push_back({operation, 0.0, which, count}); }

  Part criterion() {
    Part left = conjunction();
    while (accept_word("or") || accept("||")) {
      const Part right = conjunction();
      needs_truth(left, "or"), needs_truth(right, "or");
      step(Operation::either);
    }
    return left;
  }

  Part conjunction() {
    Part left = negation();
    while (accept_word("and") || accept("&&")) {
      const Part right = negation();
      needs_truth(left, "and"), needs_truth(right, "and");
      step(Operation::both);
    }
    return left;
  }

  Part negation() {
    const Deeper deeper(*this);
    skip_space();
    const std::size_t begin = at_;
    if (!accept_not()) return comparison();
    const Part inner = negation();
    needs_truth(inner, "not");
    step(Operation::invert);
    return {true, begin, true};
  }

  Part comparison() {
    Part left = sum();
    const std::size_t begin = left.begin;
    Criterion::Chain chain;
    std::vector<bool> names_metric;
    for (;;) {
      names_metric.push_back(left.names_metric);
      skip_space();
      const std::size_t at = at_;
      const auto found = accept_comparison();
      if (!found) break;
      needs_number(left, "a comparison");
      if (!chain.comparisons.empty() && (direction(*found) == 0 || direction(*found) != direction(chain.comparisons.back())))
        refuse(at, "a chain runs in one direction, such as 1 < bias < 2; 'and' joins comparisons");
      chain.comparisons.push_back(*found);
      const Part right = sum();
      needs_number(right, "a comparison");
      if (!left.names_metric && !right.names_metric) refuse(left.begin, "it names no metric, so it is always the same");
      left = right;
    }
    if (chain.comparisons.empty()) return left;
    chain.shown = shown_side(names_metric);
    step(Operation::compare, chains_.size());
    chains_.push_back(std::move(chain));
    return {true, begin, true};
  }

  Part sum() {
    Part left = product();
    for (;;) {
      const bool plus = accept("+");
      if (!plus && !accept("-")) return left;
      const Part right = product();
      needs_number(left, plus ? "'+'" : "'-'"), needs_number(right, plus ? "'+'" : "'-'");
      step(plus ? Operation::add : Operation::subtract);
      left.names_metric |= right.names_metric;
    }
  }

  Part product() {
    Part left = factor();
    for (;;) {
      const bool times = accept("*");
      if (!times && !accept("/")) return left;
      const Part right = factor();
      needs_number(left, times ? "'*'" : "'/'"), needs_number(right, times ? "'*'" : "'/'");
      step(times ? Operation::multiply : Operation::divide);
      left.names_metric |= right.names_metric;
    }
  }

  Part factor() {
    const Deeper deeper(*this);
    skip_space();
    const std::size_t begin = at_;
    const bool minus = accept("-");
    if (minus || accept("+")) {
      const Part inner = factor();
      needs_number(inner, minus ? "'-'" : "'+'");
      if (minus) step(Operation::negate);
      return {false, begin, inner.names_metric};
    }
    Part base = operand();
    if (!accept("^")) return base;
    const Part exponent = factor();
    needs_number(base, "'^'"), needs_number(exponent, "'^'");
    step(Operation::power);
    base.names_metric |= exponent.names_metric;
    return base;
  }

  Part operand() {
    skip_space();
    const std::size_t begin = at_;
    if (accept("(")) {
      const Part inner = criterion();
      close(begin);
      return {inner.truth, begin, inner.names_metric};
    }
    const char c = at_ < text_.size() ? text_[at_] : '\0';
    if (is_digit(c) || (c == '.' && at_ + 1 < text_.size() && is_digit(text_[at_ + 1]))) return number();
    const std::string_view name = word();
    if (c == '!' || name == "not") refuse(at_, "what is negated is a comparison; 'not' stands in front of it, or of a parenthesis");
    if (name.empty() || name == "and" || name == "or") unexpected("a number or a metric");
    at_ += name.size();
    if (accept("(")) return call(name, begin);
    step(Operation::metric, index_of(name, begin));
    return {false, begin, true};
  }

  void close(std::size_t opened) {
    if (accept(")")) return;
    unexpected(fmt::format("the ')' of column {} or an operator", column(opened)));
  }

  Part number() {
    const std::size_t begin = at_;
    double value = 0.0;
    const auto [end, failure] = std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
    at_ = static_cast<std::size_t>(end - text_.data());
    if (failure != std::errc()) refuse(begin, "a number beyond the range of doubles");
    if (at_ < text_.size() && continues_name(text_[at_])) refuse(at_, fmt::format("found '{}' right after a number", text_[at_]));
    steps_.push_back({Operation::number, value});
    return {false, begin, false};
  }

  Part call(std::string_view name, std::size_t begin) {
    const auto table = criterion_function_table();
    const auto function = std::find_if(table.begin(), table.end(), [&](const CriterionFunction& f) { return f.name == name; });
    if (function == table.end()) {
      const auto known = criterion_functions();
      refuse(begin, fmt::format("there is no function '{}' but {}{}", name, listed(known), did_you_mean(name, known)));
    }
    std::size_t count = 0;
    bool names_metric = false;
    do {
      const Part argument = criterion();
      needs_number(argument, fmt::format("{}()", name));
      names_metric |= argument.names_metric;
      ++count;
    } while (function->takes_several && accept(","));
    skip_space();
    if (!function->takes_several && at_ < text_.size() && text_[at_] == ',') refuse(at_, fmt::format("{}() takes one argument", name));
    close(begin + name.size());
    step(Operation::call, static_cast<std::size_t>(function - table.begin()), count);
    return {false, begin, names_metric};
  }

  std::size_t index_of(std::string_view name, std::size_t at) {
    const auto found = std::find_if(names_.begin(), names_.end(), [&](const auto& named) { return named.metric == name; });
    if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
    names_.push_back({std::string(name), column(at)});
    return names_.size() - 1;
  }

  std::vector<Criterion::Named>& names_;
  std::vector<Criterion::Chain>& chains_;
  std::vector<Criterion::Step>& steps_;
  std::size_t depth_ = 0;
};

}  // namespace

void read_criterion(const std::string& text, std::vector<Criterion::Named>& names, std::vector<Criterion::Chain>& chains,
                    std::vector<Criterion::Step>& steps) {
  Reader(text, names, chains, steps).read();
}

}  // namespace consort
