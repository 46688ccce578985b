#include "orchestrator/script/numbers.hpp"

#include "core/counted.hpp"
#include "core/number_text.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/memory.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>
#include <utility>

namespace consort::script {

namespace {

constexpr std::uint64_t kMostComponents = 10'000;
constexpr std::size_t kMostMistakes = 10'000;  // of a data file; it is not read beyond them

// One line per agent, comma-separated.
std::optional<PerAgent> read_number_file(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                         const std::filesystem::path& directory, std::size_t agents) {
  const auto name = read_text(mistakes, node, what);
  if (!name) return std::nullopt;
  const std::filesystem::path file = directory / *name;
  std::string bytes;
  try {
    bytes = read_input(file);
  } catch (const ConfigError& error) {
    mistakes.add(node, fmt::format("{}: found '{}', which {} beside the experiment", what, shown(*name), error.what()));
    return std::nullopt;
  }
  std::istringstream in(bytes.starts_with("\xef\xbb\xbf") ? bytes.substr(3) : bytes);  // a byte order mark
  const std::size_t before = mistakes.count();
  PerAgent::List list;
  std::size_t lines = 0;  // that hold numbers
  std::string line;
  for (std::size_t number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.find_first_not_of(" \t") == std::string::npos || line.front() == '#') continue;
    std::vector<double> row;
    for (std::size_t start = 0; start <= line.size();) {
      const std::size_t comma = std::min(line.find(',', start), line.size());
      const std::string text = line.substr(start, comma - start);
      const std::size_t first = text.find_first_not_of(" \t"), last = text.find_last_not_of(" \t");
      const auto value = first == std::string::npos ? std::nullopt : finite_number(text.substr(first, last - first + 1));
      if (!value) mistakes.add(file.string(), number, start + 1, fmt::format("found '{}'; allowed: a finite number", shown(text)));
      row.push_back(value.value_or(0.0));
      if (row.size() > kMostComponents) {
        mistakes.add(file.string(), number, start + 1,
                     fmt::format("found more than {0} numbers in a line; allowed: at most {0}", kMostComponents));
        return std::nullopt;
      }
      start = comma + 1;
    }
    if (mistakes.count() - before >= kMostMistakes) return std::nullopt;
    if (++lines > agents) continue;  // they are counted, and take no memory
    list.values.push_back(Eigen::Map<const Vector>(row.data(), static_cast<Eigen::Index>(row.size())));
  }
  if (mistakes.count() != before) return std::nullopt;
  if (lines != agents) {
    mistakes.add(node, fmt::format("{}: found {} in '{}'; allowed: {}, one per agent", what, counted(lines, "line"), shown(*name), agents));
    return std::nullopt;
  }
  return PerAgent{list};
}

std::optional<std::pair<double, double>> read_pair(Mistakes& mistakes, const YAML::Node& node, const std::string& what, bool ascending) {
  const auto low = node.IsSequence() && node.size() == 2 ? plain_number(node[0]) : std::nullopt;
  const auto high = low ? plain_number(node[1]) : std::nullopt;
  if (high && (!ascending || *low <= *high)) return std::pair(*low, *high);
  mistakes.add(node, fmt::format("{}: found {}; allowed: two numbers {}", what,
                                 high ? fmt::format("[{}, {}]", number_text(*low), number_text(*high)) : describe(node),
                                 ascending ? "[low, high] with low <= high" : "[first, last]"));
  return std::nullopt;
}

std::optional<PerAgent> read_rule(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                  const std::filesystem::path& directory, std::size_t agents) {
  const Section section(mistakes, node, what, "/definitions/spread");
  std::vector<std::string> found;
  for (const char* key : {"all", "linspace", "uniform", "file"})
    if (present(section.find(key))) found.emplace_back(key);
  if (found.size() != 1) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: exactly one of all, linspace, uniform, file", what, listed(found)));
    return std::nullopt;
  }
  std::size_t dimension = 1;
  if (const auto dimension_node = section.find("dimension"); present(dimension_node)) {
    if (found[0] == "all" || found[0] == "file")
      mistakes.add(dimension_node, fmt::format("{}: found a dimension with {}; allowed: with linspace or uniform", what, found[0]));
    dimension = read_whole(mistakes, dimension_node, section.path("dimension"), 1, kMostComponents).value_or(1);
    mistakes.at(dimension_node.Mark());
    require_memory(sizeof(double) * static_cast<double>(agents) * static_cast<double>(dimension),
                   fmt::format("{}: {} of {}", what, counted(dimension, "component"), counted(agents, "agent")), "fewer");
  }
  const YAML::Node value = section.find(found[0]);
  const std::string place = section.path(found[0]);
  if (found[0] == "file") return read_number_file(mistakes, value, place, directory, agents);
  if (found[0] == "all") {
    const auto matrix = read_matrix(mistakes, value, place);
    return matrix ? std::optional(PerAgent{PerAgent::Same{*matrix}}) : std::nullopt;
  }
  const auto pair = read_pair(mistakes, value, place, found[0] == "uniform");
  if (!pair) return std::nullopt;
  if (found[0] == "linspace") return PerAgent{PerAgent::Linspace{pair->first, pair->second, dimension}};
  return PerAgent{PerAgent::Uniform{pair->first, pair->second, dimension}};
}

}  // namespace

std::optional<PerAgent> read_per_agent(Mistakes& mistakes, const YAML::Node& node, const std::string& what,
                                       const std::filesystem::path& directory, std::size_t agents) {
  if (node.IsMap()) return read_rule(mistakes, node, what, directory, agents);
  if (!node.IsSequence()) {
    const auto value = plain_number(node);
    if (value) return PerAgent{PerAgent::Same{Matrix::Constant(1, 1, *value)}};
    mistakes.add(
        node, fmt::format(
                  "{}: found {}; allowed: a number, a list with one entry per agent, or one of {{all: ...}}, {{linspace: [first, last]}}, "
                  "{{uniform: [low, high]}}, {{file: ...}}",
                  what, describe(node)));
    return std::nullopt;
  }
  if (node.size() != agents) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: {}, one per agent (the same vector for all is written {{all: [...]}})", what,
                                   describe(node), counted(agents, "entry")));
    return std::nullopt;
  }
  const std::size_t before = mistakes.count();
  PerAgent::List list;
  for (std::size_t i = 0; i < node.size(); ++i)
    if (const auto value = read_matrix(mistakes, node[i], fmt::format("{}[{}]", what, i))) list.values.push_back(*value);
  return mistakes.count() == before ? std::optional(PerAgent{list}) : std::nullopt;
}

bool known(Mistakes& mistakes, const YAML::Node& key, const std::string& what, const std::vector<std::string>& names) {
  const std::string name = key.IsScalar() ? key.Scalar() : describe(key);
  if (std::find(names.begin(), names.end(), name) != names.end()) return true;
  mistakes.add(key,
               fmt::format("{}: found the unknown name '{}'; allowed: {}{}", what, shown(name), listed(names), did_you_mean(name, names)));
  return false;
}

const ValueDoc* doc_of(std::span<const ValueDoc> docs, std::string_view name) {
  const auto it = std::find_if(docs.begin(), docs.end(), [name](const ValueDoc& doc) { return doc.name == name; });
  return it == docs.end() ? nullptr : &*it;
}

std::optional<Matrix> read_value(Mistakes& mistakes, const ValueDoc* doc, const YAML::Node& node, const std::string& what) {
  const auto words = doc == nullptr ? std::vector<std::string>{} : choices_of(*doc);
  if (words.empty()) return read_matrix(mistakes, node, what, doc != nullptr && doc->shape == kSwitch);
  const auto index = read_choice(mistakes, node, what, words);
  return index ? std::optional<Matrix>(Matrix::Constant(1, 1, static_cast<double>(*index))) : std::nullopt;
}

}  // namespace consort::script
