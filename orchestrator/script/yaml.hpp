#pragma once
/// Reading YAML with positions: everything wrong becomes one line `file:line:column: what was found; what is allowed; did you mean`.

#include "core/errors.hpp"
#include "core/types.hpp"

#include <yaml-cpp/yaml.h>

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace consort::script {

/// A mistake that has its place in the text already.
struct PlacedError : ConfigError {
  using ConfigError::ConfigError;
};

/// Collects the mistakes of a file, so that the user sees all of them at once.
class Mistakes {
 public:
  explicit Mistakes(std::string file) : file_(std::move(file)) {}
  void add(const YAML::Mark& mark, const std::string& text);
  /// A node that is there without a value stands where its key does.
  void add(const YAML::Node& node, const std::string& text);
  /// A mistake in another file (a data file); `line` and `column` count from 1.
  void add(const std::string& file, std::size_t line, std::size_t column, const std::string& text);
  [[nodiscard]] bool none() const { return found_.empty(); }
  [[nodiscard]] std::size_t count() const { return found_.size() + not_kept_; }
  /// The text of the file. It need not outlive the call.
  void are_in(const std::string& text) { text_ = text; }
  /// What is read from now on stands here: the place of an objection that names none.
  void at(const YAML::Mark& mark) { here_ = mark; }
  /// As add, where nothing better is known.
  void add_here(const std::string& text) { add(here_, text); }
  /// Throws a PlacedError with one line per mistake, in order of place. Returns if there are none.
  void raise() const;

 private:
  struct Entry {
    std::string file;
    std::size_t line, column;
    std::string text;
  };
  std::string file_, text_;
  std::vector<Entry> found_;
  std::size_t not_kept_ = 0;  // more than anybody reads
  YAML::Mark here_;
};

/// The keys the schema allows at a JSON pointer, e.g. "/definitions/agents" -> count, protocol, ... (in the order of the schema).
std::vector<std::string> schema_keys(std::string_view pointer);
/// Checks the whole document against the JSON Schema and adds what it finds.
void check_against_schema(const YAML::Node& document, Mistakes& mistakes);

/// Where the text stops being UTF-8 (RFC 3629); nothing if all of it is.
std::optional<std::size_t> first_byte_not_utf8(std::string_view text);
/// What a node is, for messages: "text 'abc'", "a list of 3", "a mapping", "nothing".
std::string describe(const YAML::Node& node);
/// Text of the user's for a message: shortened if it is long, with what a terminal cannot show written as \x1b.
std::string shown(std::string_view text);

/// A finite number, decimal, with nothing around it.
std::optional<double> finite_number(std::string_view text);
/// A finite number written plainly (quoted text is not a number). Decimal only: 010 is ten.
std::optional<double> plain_number(const YAML::Node& node);
/// true or false written plainly.
std::optional<bool> plain_switch(const YAML::Node& node);
/// Whole number without sign.
std::optional<std::uint64_t> whole_number(const YAML::Node& node);

struct Range {
  double low, high;
  bool low_open = false;  ///< `low` itself is not allowed
  [[nodiscard]] bool holds(double value) const { return (low_open ? value > low : value >= low) && value <= high; }
  [[nodiscard]] std::string text() const;
};
inline constexpr double kUnbounded = std::numeric_limits<double>::infinity();
inline constexpr Range kAnyNumber{-kUnbounded, kUnbounded, false};
inline constexpr Range kProbability{0.0, 1.0, false};
inline constexpr Range kPositive{0.0, kUnbounded, true};

std::optional<double> read_number(Mistakes&, const YAML::Node&, const std::string& what, Range range = kAnyNumber);
std::optional<std::uint64_t> read_whole(Mistakes&, const YAML::Node&, const std::string& what, std::uint64_t low, std::uint64_t high);
std::optional<std::string> read_text(Mistakes&, const YAML::Node&, const std::string& what);
/// Index into `choices`.
std::optional<std::size_t> read_choice(Mistakes&, const YAML::Node&, const std::string& what, std::span<const std::string> choices);
/// A number (1 x 1), a list (n x 1) or a list of rows; with `switches`, true and false count as 1 and 0.
std::optional<Matrix> read_matrix(Mistakes&, const YAML::Node&, const std::string& what, bool switches = false);
/// "60 s", "500 ms", "2 min" or a number of seconds; above 0, or from 0 with `zero`.
std::optional<Seconds> read_duration(Mistakes&, const YAML::Node&, const std::string& what, bool zero = false);
/// `rounds` (a time over dt) as the number of the first round that begins at or after it. What lies within a billionth of a round's
/// beginning (of its time; of a round, at the start) is that round: 0.3 s of dt = 0.1 s is round 3.
double first_round_from(double rounds);

/// Reports keys that occur twice, anywhere in the document.
void check_duplicate_keys(Mistakes&, const YAML::Node&);

/// A mapping under reading. Unknown keys are reported on construction; `find` gives an invalid node for what is absent.
class Section {
 public:
  /// `what` names it in messages ("links"); empty at the top. `schema_pointer` says which keys are allowed.
  Section(Mistakes& mistakes, const YAML::Node& node, std::string what, std::string_view schema_pointer);
  [[nodiscard]] bool is_map() const { return is_map_; }
  [[nodiscard]] YAML::Node find(const std::string& key) const;
  /// As find; absence is a mistake.
  [[nodiscard]] YAML::Node required(const std::string& key) const;
  [[nodiscard]] std::string path(const std::string& key) const { return what_.empty() ? key : what_ + "." + key; }
  [[nodiscard]] const YAML::Node& node() const { return node_; }

 private:
  Mistakes& mistakes_;
  const YAML::Node node_;
  std::string what_;
  bool is_map_;
};

/// True for a node that is there (not merely present without a value).
inline bool present(const YAML::Node& node) { return node.IsDefined(); }

}  // namespace consort::script
