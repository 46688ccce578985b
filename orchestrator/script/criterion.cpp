#include "orchestrator/script/criterion.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

namespace consort {
namespace {

using Comparison = Criterion::Comparison;
using Operation = Criterion::Operation;

constexpr std::string_view kAllowed = "a comparison over metric names, such as 'abs(bias) < 1e-6'; and, or, not join several";
constexpr std::size_t kDeepest = 200;

struct Function {
  std::string_view name;
  bool takes_several;
  double (*value)(std::span<const double>);
};

constexpr std::array kFunctions{
    Function{"abs", false, [](std::span<const double> x) { return std::abs(x[0]); }},
    Function{"sqrt", false, [](std::span<const double> x) { return std::sqrt(x[0]); }},
    Function{"exp", false, [](std::span<const double> x) { return std::exp(x[0]); }},
    Function{"ln", false, [](std::span<const double> x) { return std::log(x[0]); }},
    Function{"log10", false, [](std::span<const double> x) { return std::log10(x[0]); }},
    Function{"min", true, [](std::span<const double> x) { return *std::min_element(x.begin(), x.end()); }},
    Function{"max", true, [](std::span<const double> x) { return *std::max_element(x.begin(), x.end()); }},
};

struct Symbol {
  std::string_view text;
  Comparison comparison;
};
// The longer first, so that <= is not read as <.
constexpr std::array kComparisons{Symbol{"<=", Comparison::at_most}, Symbol{">=", Comparison::at_least}, Symbol{"==", Comparison::equal},
                                  Symbol{"!=", Comparison::unequal}, Symbol{"<", Comparison::less},      Symbol{">", Comparison::greater}};

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool begins_name(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool continues_name(char c) { return begins_name(c) || is_digit(c) || c == '.' || c == '[' || c == ']'; }
bool continues_character(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }  // of UTF-8

/// A message is one line, and does not end where the text has a NUL.
std::string printable(std::string text) {
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  return text;
}

/// The way a chain runs; none for !=, which says nothing of the outer two.
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

/// The side of a chain whose value is worth showing, from which of them name a metric: the first that others enclose, or else the first.
std::size_t shown_side(const std::vector<bool>& names_metric) {
  const auto inner = std::find(names_metric.begin() + 1, names_metric.end() - 1, true);
  const auto found = inner != names_metric.end() - 1 ? inner : std::find(names_metric.begin(), names_metric.end(), true);
  return static_cast<std::size_t>(found - names_metric.begin());
}

/// Reads a text into steps in postfix order.
class Reader {
 public:
  Reader(const std::string& text, std::vector<Criterion::Named>& names, std::vector<Criterion::Chain>& chains,
         std::vector<Criterion::Step>& steps)
      : text_(text), names_(names), chains_(chains), steps_(steps) {}

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

  [[nodiscard]] std::size_t column(std::size_t at) const {
    const auto begin = text_.begin(), end = begin + static_cast<std::ptrdiff_t>(at);
    return 1 + static_cast<std::size_t>(std::count_if(begin, end, [](char c) { return !continues_character(c); }));
  }

  [[noreturn]] void refuse(std::size_t at, const std::string& why) const {
    throw ConfigError(printable(fmt::format("criterion: found '{}' (column {}: {}); allowed: {}", text_, column(at), why, kAllowed)));
  }

  // Says what stands here instead of what belongs here.
  [[noreturn]] void unexpected(std::string_view wanted) const {
    if (at_ >= text_.size()) refuse(at_, fmt::format("it ends where {} is missing", wanted));
    const char c = text_[at_];
    if (c == ',') refuse(at_, "',' stands between the arguments of a call only; 'and' joins comparisons, a decimal point is '.'");
    if (c == '=') refuse(at_, "'=' assigns; '==' compares, and so do '<=' and '>='");
    if (c == '&' || c == '|') refuse(at_, fmt::format("found a single '{0}'; '{0}{0}' joins comparisons", c));
    std::size_t end = at_ + 1;
    while (end < text_.size() && (begins_name(c) ? continues_name(text_[end]) : continues_character(text_[end]))) ++end;
    refuse(at_, fmt::format("found '{}' in the place of {}", text_.substr(at_, end - at_), wanted));
  }

  void skip_space() {
    while (at_ < text_.size() && std::string_view(" \t\r\n").find(text_[at_]) != std::string_view::npos) ++at_;
  }

  [[nodiscard]] std::string_view word() const {
    std::size_t end = at_;
    if (end < text_.size() && begins_name(text_[end]))
      while (end < text_.size() && continues_name(text_[end])) ++end;
    return std::string_view(text_).substr(at_, end - at_);
  }

  // Takes `symbol` if it stands here.
  bool take(std::string_view symbol) {
    skip_space();
    if (!std::string_view(text_).substr(at_).starts_with(symbol)) return false;
    at_ += symbol.size();
    return true;
  }

  bool take_word(std::string_view wanted) {
    skip_space();
    if (word() != wanted) return false;
    at_ += wanted.size();
    return true;
  }

  bool take_not() {
    skip_space();
    const bool differs = std::string_view(text_).substr(at_).starts_with("!=");
    return take_word("not") || (!differs && take("!"));
  }

  std::optional<Comparison> take_comparison() {
    for (const Symbol& symbol : kComparisons)
      if (take(symbol.text)) return symbol.comparison;
    return std::nullopt;
  }

  void needs_truth(const Part& part, std::string_view joint) const {
    if (!part.truth) refuse(part.begin, fmt::format("no comparison where '{}' asks for one", joint));
  }
  void needs_number(const Part& part, std::string_view place) const {
    if (part.truth) refuse(part.begin, fmt::format("a comparison where {} asks for a number", place));
  }

  void step(Operation operation, std::size_t which = 0, std::size_t count = 0) { steps_.push_back({operation, 0.0, which, count}); }

  Part criterion() {
    Part left = conjunction();
    while (take_word("or") || take("||")) {
      const Part right = conjunction();
      needs_truth(left, "or"), needs_truth(right, "or");
      step(Operation::either);
    }
    return left;
  }

  Part conjunction() {
    Part left = negation();
    while (take_word("and") || take("&&")) {
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
    if (!take_not()) return comparison();
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
      const auto found = take_comparison();
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
      const bool plus = take("+");
      if (!plus && !take("-")) return left;
      const Part right = product();
      needs_number(left, plus ? "'+'" : "'-'"), needs_number(right, plus ? "'+'" : "'-'");
      step(plus ? Operation::add : Operation::subtract);
      left.names_metric |= right.names_metric;
    }
  }

  Part product() {
    Part left = factor();
    for (;;) {
      const bool times = take("*");
      if (!times && !take("/")) return left;
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
    const bool minus = take("-");
    if (minus || take("+")) {
      const Part inner = factor();
      needs_number(inner, minus ? "'-'" : "'+'");
      if (minus) step(Operation::negate);
      return {false, begin, inner.names_metric};
    }
    Part base = operand();
    if (!take("^")) return base;
    const Part exponent = factor();
    needs_number(base, "'^'"), needs_number(exponent, "'^'");
    step(Operation::power);
    base.names_metric |= exponent.names_metric;
    return base;
  }

  Part operand() {
    skip_space();
    const std::size_t begin = at_;
    if (take("(")) {
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
    if (take("(")) return call(name, begin);
    step(Operation::metric, index_of(name, begin));
    return {false, begin, true};
  }

  void close(std::size_t opened) {
    if (take(")")) return;
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
    const auto function = std::find_if(kFunctions.begin(), kFunctions.end(), [&](const Function& f) { return f.name == name; });
    if (function == kFunctions.end()) {
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
    } while (function->takes_several && take(","));
    skip_space();
    if (!function->takes_several && at_ < text_.size() && text_[at_] == ',') refuse(at_, fmt::format("{}() takes one argument", name));
    close(begin + name.size());
    step(Operation::call, static_cast<std::size_t>(function - kFunctions.begin()), count);
    return {false, begin, names_metric};
  }

  std::size_t index_of(std::string_view name, std::size_t at) {
    const auto found = std::find_if(names_.begin(), names_.end(), [&](const auto& named) { return named.metric == name; });
    if (found != names_.end()) return static_cast<std::size_t>(found - names_.begin());
    names_.push_back({std::string(name), column(at)});
    return names_.size() - 1;
  }

  const std::string& text_;
  std::vector<Criterion::Named>& names_;
  std::vector<Criterion::Chain>& chains_;
  std::vector<Criterion::Step>& steps_;
  std::size_t at_ = 0, depth_ = 0;
};

/// The stack on which a criterion is worked out.
class Stack {
 public:
  void push(double value) { values_.push_back(value); }
  double pop() {
    const double top = values_.back();
    values_.pop_back();
    return top;
  }
  /// The last `count`, taken off.
  std::vector<double> pop(std::size_t count) {
    std::vector<double> top(values_.end() - static_cast<std::ptrdiff_t>(count), values_.end());
    values_.resize(values_.size() - count);
    return top;
  }
  [[nodiscard]] bool holds_a_number() const { return !std::isnan(values_.back()); }

 private:
  std::vector<double> values_;
};

bool all_hold(const Criterion::Chain& chain, const std::vector<double>& sides) {
  for (std::size_t i = 0; i < chain.comparisons.size(); ++i)
    if (!holds(chain.comparisons[i], sides[i], sides[i + 1])) return false;
  return true;
}

/// What two operands make.
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

Criterion::Criterion(std::string text) : text_(std::move(text)) { Reader(text_, names_, chains_, steps_).read(); }

Criterion::Verdict Criterion::judge(const Metrics& metrics) const {
  Stack stack;
  std::optional<double> shown;
  bool known = true;
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
        stack.push(kFunctions[step.which].value(stack.pop(step.count)));
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
    known = known && stack.holds_a_number();
  }
  return {known && stack.pop() != 0.0, shown.value_or(std::numeric_limits<double>::quiet_NaN())};
}

std::vector<std::string> criterion_functions() {
  std::vector<std::string> names;
  for (const Function& function : kFunctions) names.emplace_back(function.name);
  return names;
}

}  // namespace consort
