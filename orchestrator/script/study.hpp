#pragma once
/// A study: an experiment once for each combination of values of any of its keys, as `sweep` in the file and `--set` ask for. One
/// combination is a cell: the experiment file with these keys replaced, over all its seeds.

#include "orchestrator/script/setting.hpp"

#include <span>
#include <string>
#include <vector>

namespace consort {

struct Cell {
  std::vector<Setting> settings;
  [[nodiscard]] std::string label() const;             ///< "loss_0.1.dt_0.5": behind the protocol, in the names of metrics
  [[nodiscard]] std::optional<double> number() const;  ///< where one key is swept, and its value is one
  [[nodiscard]] std::string shown() const;             ///< "links.loss = 0.1, dt = 0.5"
};

struct Study {
  std::vector<std::string> keys;  ///< what is swept, in order
  std::vector<Cell> cells;        ///< the values of the first key change slowest; none: nothing is swept
  std::vector<Setting> fixed;     ///< what `--set` gives one value: of every cell
  struct Judged {
    std::string text;
    int line, column;
  };
  std::vector<Judged> criteria;  ///< over the table of all cells
  bool within_a_run = true;      ///< nothing is swept, or a key of the links by the file alone, which a single run does
};

inline constexpr std::size_t kMostCells = 100'000;

/// Of an experiment file and `--set KEY=VALUES`. `zipped`: the keys that are set take their values together instead of each with each.
/// Throws ConfigError that names the place of what is wrong.
Study study_of(const std::string& text, const std::string& name, std::span<const std::string> sets = {}, bool zipped = false);

namespace script {

/// Of a sweep that only a study can do: the first cell.
std::optional<Cell> first_cell(Mistakes& mistakes, const YAML::Node& sweep);

/// A value of a swept key, and what it is called.
struct SweptValue {
  std::string label;
  YAML::Node value;
};
/// What `node` gives `key`: a list, named values, linspace or logspace; `least`: how many there must be. In a list a value may come
/// `again`.
std::vector<SweptValue> swept_values(Mistakes& mistakes, const YAML::Node& node, const std::string& what, const std::string& key,
                                     std::size_t least, bool again = false);
/// A value as a number: plain, in s where it is a duration, or the only thing in a mapping ({bernoulli: 0.1}).
std::optional<double> number_in(const YAML::Node& value);

}  // namespace script
}  // namespace consort
