#include "orchestrator/script/study.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/document.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace consort {
namespace {

using namespace script;

constexpr std::string_view kLinks = "links.";

// Keys that change together: what each of them is in each step.
struct Axis {
  std::vector<std::string> keys;
  std::vector<std::vector<Setting>> steps;
};

Axis axis_of(Mistakes& mistakes, const YAML::Node& node, const std::string& what, const std::string& key, std::size_t least,
             bool again = false) {
  Axis axis{{key}, {}};
  for (const SweptValue& swept : swept_values(mistakes, node, what, key, least, again)) {
    const YAML::Mark mark = swept.value.Mark();
    axis.steps.push_back({{key, one_line(swept.value), swept.label, number_in(swept.value), mark.line, mark.column}});
  }
  return axis;
}

Axis zipped_of(const std::vector<Axis>& axes) {
  Axis out = axes.front();
  for (std::size_t i = 1; i < axes.size(); ++i) {
    out.keys.insert(out.keys.end(), axes[i].keys.begin(), axes[i].keys.end());
    for (std::size_t step = 0; step < std::min(out.steps.size(), axes[i].steps.size()); ++step)
      out.steps[step].insert(out.steps[step].end(), axes[i].steps[step].begin(), axes[i].steps[step].end());
  }
  return out;
}

// "a has 2, b has 3", where that is so.
std::string unequal(const std::vector<Axis>& axes) {
  std::string text;
  bool equal = true;
  for (const Axis& axis : axes) {
    text += fmt::format("{}{} has {}", text.empty() ? "" : ", ", axis.keys.front(), axis.steps.size());
    equal = equal && axis.steps.size() == axes.front().steps.size();
  }
  return equal ? "" : text;
}

std::string name_of_key(const YAML::Node& key) { return key.IsScalar() ? key.Scalar() : ""; }

Axis zip_of(Mistakes& mistakes, const YAML::Node& node) {
  std::vector<Axis> axes;
  if (node.IsMap())
    for (const auto& entry : node)
      axes.push_back(axis_of(mistakes, entry.second, "sweep.zip." + name_of_key(entry.first), name_of_key(entry.first), 2, true));
  if (axes.size() < 2) {
    mistakes.add(node, fmt::format("sweep.zip: found {}; allowed: a mapping from two keys or more to their values", describe(node)));
    return {};
  }
  if (const std::string found = unequal(axes); !found.empty())
    mistakes.add(node, fmt::format("sweep.zip: found unequal numbers of values: {}; allowed: as many for each key", found));
  Axis zipped = zipped_of(axes);
  std::set<std::string> names;
  for (const auto& step : zipped.steps)
    if (const std::string name = Cell{step}.label(); !names.insert(name).second)
      mistakes.add(node, fmt::format("sweep.zip: found {} a second time; allowed: each combination once", name));
  return zipped;
}

std::vector<Axis> axes_of(Mistakes& mistakes, const YAML::Node& sweep) {
  std::vector<Axis> axes;
  if (!sweep.IsMap() || sweep.size() == 0) {
    mistakes.add(sweep, fmt::format("sweep: found {}; allowed: keys of this file and their values, such as {{links.loss: [0, 0.1, 0.2]}}",
                                    describe(sweep)));
    return axes;
  }
  for (const auto& entry : sweep) {
    const std::string key = name_of_key(entry.first);
    axes.push_back(key == "zip" ? zip_of(mistakes, entry.second) : axis_of(mistakes, entry.second, "sweep." + key, key, 2));
  }
  return axes;
}

bool is_within_a_run(const YAML::Node& sweep) {
  return !present(sweep) || (sweep.IsMap() && sweep.size() == 1 && name_of_key(sweep.begin()->first).starts_with(kLinks));
}

// Each with each; the first changes slowest.
std::vector<Cell> grid_of(Mistakes& mistakes, const std::vector<Axis>& axes) {
  double count = 1;
  for (const Axis& axis : axes) count *= static_cast<double>(axis.steps.size());
  if (count > kMostCells) {
    mistakes.add_here(fmt::format("sweep: found {:.0f} cells; allowed: up to {}", count, kMostCells));
    return {};
  }
  if (axes.empty()) return {};
  std::vector<Cell> cells{{}};
  for (const Axis& axis : axes) {
    std::vector<Cell> longer;
    for (const Cell& cell : cells)
      for (const auto& step : axis.steps) {
        longer.push_back(cell);
        longer.back().settings.insert(longer.back().settings.end(), step.begin(), step.end());
      }
    cells = std::move(longer);
  }
  return cells;
}

// `--set KEY=VALUES`: 0,0.1,0.2 or linspace(0, 1, 5) or anything that may stand in the file.
Axis set_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw ConfigError(fmt::format("--set: found '{}'; allowed: KEY=VALUES, such as links.loss=0,0.1,0.2 or dt='linspace(0.1, 1, 4)'",
                                  script::shown(text)));
  const std::string key = text.substr(0, equals), values = text.substr(equals + 1), what = "--set " + key;
  Mistakes mistakes(what);
  const bool whole = values.starts_with('[') || values.starts_with('{') || values.ends_with(')');
  YAML::Node node = read_document(whole ? "x: " + values : "x: [" + values + "]", mistakes)["x"];
  mistakes.raise();
  if (!node.IsSequence() && !(node.IsMap() && node.size() > 1) && !(node.IsMap() && node.begin()->second.IsSequence()) && !node.IsScalar())
    node.reset(YAML::Load("[" + values + "]"));  // a mapping that is one value
  Axis axis = axis_of(mistakes, node, key, key, 1);
  mistakes.raise();
  for (auto& step : axis.steps) step.front().line = step.front().column = -1;
  return axis;
}

void check_keys_once(Mistakes& mistakes, const YAML::Node& place, const std::vector<Axis>& axes) {
  std::vector<std::string> keys;
  for (const Axis& axis : axes)
    for (const std::string& key : axis.keys) {
      if (std::find(keys.begin(), keys.end(), key) != keys.end())
        mistakes.add(place, fmt::format("sweep: found {} a second time; allowed: each key once", script::shown(key)));
      keys.push_back(key);
    }
}

}  // namespace

std::string Cell::label() const {
  std::string text;
  for (const Setting& setting : settings) text += (text.empty() || setting.label.empty() ? "" : ".") + setting.label;
  return text;
}

std::optional<double> Cell::number() const { return settings.size() == 1 ? settings.front().number : std::nullopt; }

std::string Cell::shown() const {
  std::string text;
  for (const Setting& setting : settings) text += (text.empty() ? "" : ", ") + consort::shown(setting);
  return text;
}

std::optional<Cell> script::first_cell(Mistakes& mistakes, const YAML::Node& sweep) {
  if (is_within_a_run(sweep)) return std::nullopt;
  const auto cells = grid_of(mistakes, axes_of(mistakes, sweep));
  return cells.empty() ? std::nullopt : std::optional(cells.front());
}

namespace {

Study read_study(const std::string& text, const std::string& name, std::span<const std::string> sets, bool zipped) {
  Study study;
  std::vector<Axis> set;
  for (const std::string& one : sets) {
    Axis axis = set_of(one);
    if (axis.steps.size() > 1) {
      set.push_back(std::move(axis));
      continue;
    }
    axis.steps.front().front().label.clear();
    study.fixed.push_back(std::move(axis.steps.front().front()));
  }
  Mistakes mistakes(name);
  const std::string plain = plain_text(text);
  const YAML::Node document = read_document(plain, mistakes);
  mistakes.raise();
  const YAML::Node sweep = document.IsMap() ? document["sweep"] : YAML::Node(YAML::NodeType::Undefined);
  std::vector<Axis> axes;
  if (present(sweep)) axes = axes_of(mistakes, sweep);
  check_keys_once(mistakes, sweep, axes);
  // What the command line sets, the file does not sweep.
  std::erase_if(axes, [&](const Axis& axis) {
    const auto is_set = [&](const std::string& key) {
      return std::any_of(study.fixed.begin(), study.fixed.end(), [&](const Setting& setting) { return setting.key == key; }) ||
             std::any_of(set.begin(), set.end(), [&](const Axis& other) { return other.keys.front() == key; });
    };
    return std::any_of(axis.keys.begin(), axis.keys.end(), is_set);
  });
  if (zipped && set.size() > 1) {
    if (const std::string found = unequal(set); !found.empty())
      throw ConfigError(fmt::format("--zip: found unequal numbers of values: {}; allowed: as many for each key", found));
    set = {zipped_of(set)};
  }
  YAML::Node whole = document;
  for (const Setting& setting : study.fixed) whole.reset(with_setting(whole, setting));
  if (const YAML::Node criteria = whole["criteria"]; present(criteria) && criteria.IsSequence())
    for (const auto& one : criteria)
      if (one.IsScalar()) study.criteria.push_back({one.Scalar(), one.Mark().line, one.Mark().column});
  study.within_a_run = set.empty() && (axes.empty() || is_within_a_run(sweep));
  axes.insert(axes.end(), set.begin(), set.end());
  study.cells = grid_of(mistakes, axes);
  mistakes.raise();
  for (const Axis& axis : axes) study.keys.insert(study.keys.end(), axis.keys.begin(), axis.keys.end());
  return study;
}

}  // namespace

Study study_of(const std::string& text, const std::string& name, std::span<const std::string> sets, bool zipped) {
  try {
    return read_study(text, name, sets, zipped);
  } catch (const YAML::Exception& error) {
    throw ConfigError(fmt::format("{}: found what a sweep cannot have: {}", name, error.msg));
  }
}

}  // namespace consort
