/// Random criteria, printed with random spaces, parentheses and spellings, against a dumb evaluator of the tree they were printed from.

#include "core/random.hpp"
#include "orchestrator/script/criteria.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace consort {
namespace {

const Metrics kMetrics{{"a", 2.0}, {"b.c[1]", -3.0}, {"p_1.loss_0.5.d.std", 0.5}, {"e5", 0.0}, {"none", std::nan("")}};

struct Tree {
  std::string what;  // a sign, a function, a metric, or "#" for a number
  std::vector<Tree> parts;
  std::vector<std::string> signs = {};  // of a chain
  double number = 0.0;
};

class Draws {
 public:
  explicit Draws(std::uint64_t seed) : stream_(Seed{seed}.stream(Purpose{"criteria"})) {}
  std::size_t below(std::size_t count) { return stream_.below(count); }
  bool coin() { return below(2) == 0; }

 private:
  Stream stream_;
};

Tree number_tree(Draws& draws, int depth) {
  static const std::array<std::string, 6> kKinds{"+", "-", "*", "/", "^", "neg"};
  static const std::array<std::string, 4> kCalls{"abs", "sqrt", "min", "max"};
  static const std::array<double, 5> kNumbers{0.5, 1.0, 2.0, 3.0, 1e-6};
  const std::size_t kind = depth == 0 ? 9 + draws.below(3) : draws.below(12);
  if (kind < 5) return {kKinds[kind], {number_tree(draws, depth - 1), number_tree(draws, depth - 1)}};
  if (kind == 5) return {"neg", {number_tree(draws, depth - 1)}};
  if (kind < 9) {
    Tree call{kCalls[draws.below(4)], {}};
    const std::size_t count = call.what[0] == 'm' ? 1 + draws.below(3) : 1;
    for (std::size_t i = 0; i < count; ++i) call.parts.push_back(number_tree(draws, depth - 1));
    return call;
  }
  if (kind == 9) return {"#", {}, {}, kNumbers[draws.below(kNumbers.size())]};
  static const std::array<std::string, 4> kNames{"a", "b.c[1]", "p_1.loss_0.5.d.std", "e5"};
  return {draws.below(40) == 0 ? "none" : kNames[draws.below(kNames.size())], {}};
}

bool names_metric(const Tree& tree) {
  if (kMetrics.contains(tree.what)) return true;
  for (const Tree& part : tree.parts)
    if (names_metric(part)) return true;
  return false;
}

Tree chain_tree(Draws& draws) {
  static const std::array<std::array<std::string, 2>, 2> kRuns{{{"<", "<="}, {">", ">="}}};
  Tree chain{"chain", {number_tree(draws, 2)}};
  const std::size_t run = draws.below(4), sides = run < 2 ? 1 + draws.below(3) : 1;
  for (std::size_t i = 0; i < sides; ++i) {
    chain.signs.push_back(run < 2 ? kRuns[run][draws.below(2)] : run == 2 ? "==" : "!=");
    chain.parts.push_back(number_tree(draws, 2));
    const std::size_t last = chain.parts.size() - 1;
    if (!names_metric(chain.parts[last - 1]) && !names_metric(chain.parts[last])) chain.parts[last] = {"a", {}};
  }
  return chain;
}

Tree truth_tree(Draws& draws, int depth) {
  const std::size_t kind = depth == 0 ? 3 : draws.below(4);
  if (kind < 2) return {kind == 0 ? "and" : "or", {truth_tree(draws, depth - 1), truth_tree(draws, depth - 1)}};
  if (kind == 2) return {"not", {truth_tree(draws, depth - 1)}};
  return chain_tree(draws);
}

/// How tightly a tree's sign binds.
int strength(const Tree& tree) {
  static const std::array<std::pair<const char*, int>, 10> kStrengths{
      {{"or", 1}, {"and", 2}, {"not", 3}, {"chain", 4}, {"+", 5}, {"-", 5}, {"*", 6}, {"/", 6}, {"neg", 7}, {"^", 8}}};
  for (const auto& [what, value] : kStrengths)
    if (tree.what == what) return value;
  return 9;
}

class Printer {
 public:
  explicit Printer(Draws& draws) : draws_(draws) {}

  std::string text(const Tree& tree, int least = 0) {
    const bool needed = strength(tree) < least;
    return needed || draws_.below(6) == 0 ? "(" + space() + bare(tree) + space() + ")" : bare(tree);
  }

 private:
  std::string bare(const Tree& tree) {
    const int own = strength(tree);
    const auto& parts = tree.parts;
    if (tree.what == "#") return fmt::format("{}", tree.number);
    if (tree.what == "not") return draws_.coin() ? "not " + text(parts[0], own) : "!" + space() + text(parts[0], own);
    if (tree.what == "neg") return "-" + space() + text(parts[0], own);
    if (tree.what == "chain") {
      std::string out = text(parts[0], own + 1);
      for (std::size_t i = 1; i < parts.size(); ++i) out += space() + tree.signs[i - 1] + space() + text(parts[i], own + 1);
      return out;
    }
    if (own == 9) return parts.empty() ? tree.what : call(tree);
    if (own < 3) {
      const std::string sign = draws_.coin() ? " " + tree.what + " " : tree.what == "or" ? "||" : "&&";
      return text(parts[0], own) + sign + text(parts[1], own + 1);
    }
    // Powers bind to the right, and their exponent may have a sign.
    if (own == 8) return text(parts[0], 9) + space() + "^" + space() + text(parts[1], 7);
    return text(parts[0], own) + space() + tree.what + space() + text(parts[1], own + 1);
  }

  std::string call(const Tree& tree) {
    std::string out = tree.what + "(";
    for (std::size_t i = 0; i < tree.parts.size(); ++i) out += (i == 0 ? "" : space() + ",") + space() + text(tree.parts[i], 5);
    return out + ")";
  }

  std::string space() { return std::string(draws_.below(3), ' '); }

  Draws& draws_;
};

/// Sets `known` to false wherever a number is none, or infinite.
double number_of(const Tree& tree, bool& known) {
  std::vector<double> x;
  for (const Tree& part : tree.parts) x.push_back(number_of(part, known));
  double out = 0.0;
  if (tree.what == "#")
    out = tree.number;
  else if (kMetrics.contains(tree.what))
    out = kMetrics.at(tree.what);
  else if (tree.what == "+")
    out = x[0] + x[1];
  else if (tree.what == "-")
    out = x[0] - x[1];
  else if (tree.what == "*")
    out = x[0] * x[1];
  else if (tree.what == "/")
    out = x[0] / x[1];
  else if (tree.what == "^")
    out = std::pow(x[0], x[1]);
  else if (tree.what == "neg")
    out = -x[0];
  else if (tree.what == "abs")
    out = std::abs(x[0]);
  else if (tree.what == "sqrt")
    out = std::sqrt(x[0]);
  else if (tree.what == "min")
    out = *std::min_element(x.begin(), x.end());
  else if (tree.what == "max")
    out = *std::max_element(x.begin(), x.end());
  if (!std::isfinite(out)) known = false;
  return out;
}

bool truth_of(const Tree& tree, bool& known) {
  if (tree.what != "chain") {
    const bool first = truth_of(tree.parts[0], known);
    if (tree.what == "not") return !first;
    const bool second = truth_of(tree.parts[1], known);
    return tree.what == "and" ? first && second : first || second;
  }
  bool out = true;
  for (std::size_t i = 1; i < tree.parts.size(); ++i) {
    const double left = number_of(tree.parts[i - 1], known), right = number_of(tree.parts[i], known);
    const std::string& sign = tree.signs[i - 1];
    const bool holds = sign == "<"    ? left < right
                       : sign == "<=" ? left <= right
                       : sign == ">"  ? left > right
                       : sign == ">=" ? left >= right
                       : sign == "==" ? left == right
                                      : left != right;
    out = out && holds;
  }
  return out;
}

TEST(CriterionProperty, RandomCriteriaMeanWhatTheTreeTheyWerePrintedFromMeans) {
  std::size_t met = 0, unmet = 0, unknown = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    SCOPED_TRACE(seed);
    Draws draws(seed);
    for (int i = 0; i < 20; ++i) {
      const Tree tree = truth_tree(draws, 3);
      const std::string text = Printer(draws).text(tree);
      bool known = true;
      const bool truth = truth_of(tree, known);
      EXPECT_EQ(judge(std::vector{text}, kMetrics).front().met, known && truth) << text;
      ++(!known ? unknown : truth ? met : unmet);
    }
  }
  for (const std::size_t count : {met, unmet, unknown}) EXPECT_GT(count, 400u) << "every fate is met often";
}

}  // namespace
}  // namespace consort
