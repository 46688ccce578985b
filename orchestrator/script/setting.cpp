#include "orchestrator/script/setting.hpp"

#include "core/errors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace consort {

std::string shown(const Setting& setting) { return fmt::format("{} = {}", setting.key, script::shown(setting.value)); }

namespace script {
namespace {

// Of these only one may stand beside the other keys.
bool excludes(std::string_view key, std::string_view other) {
  static constexpr std::array<std::pair<std::string_view, std::string_view>, 3> kPairs{
      {{"delay", "delay_rounds"}, {"rounds", "duration"}, {"protocol", "protocols"}}};
  return std::any_of(kPairs.begin(), kPairs.end(), [&](const auto& pair) {
    return (pair.first == key && pair.second == other) || (pair.first == other && pair.second == key);
  });
}

// An empty one where `like` stands.
YAML::Node empty_like(const YAML::Node& like, const char* text) {
  const YAML::Mark mark = like.IsDefined() ? like.Mark() : YAML::Mark();
  return placed(text, mark.line, mark.column);
}

YAML::Node with_entry(const YAML::Node& list, std::string_view entry, std::string_view rest, const YAML::Node& value) {
  const auto number = finite_number(entry);
  const bool there = number && *number >= 1 && *number <= static_cast<double>(list.size()) && *number == static_cast<int>(*number);
  if (!there) throw ConfigError(fmt::format("found entry '{}' of a list of {}; allowed: 1 to {}", shown(entry), list.size(), list.size()));
  YAML::Node out = empty_like(list, "[]");
  for (std::size_t i = 0; i < list.size(); ++i)
    out.push_back(i + 1 == static_cast<std::size_t>(*number) ? with_value(list[i], rest, value) : list[i]);
  return out;
}

}  // namespace

YAML::Node placed(const std::string& text, int line, int column) {
  const auto blank = [](int count, char c) { return std::string(static_cast<std::size_t>(std::max(0, count)), c); };
  return YAML::Load(blank(line, '\n') + blank(column, ' ') + text);
}

std::string one_line(const YAML::Node& node) {
  YAML::Emitter out;
  out.SetMapFormat(YAML::Flow);
  out.SetSeqFormat(YAML::Flow);
  out << node;
  std::string text = out.c_str();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

YAML::Node with_value(const YAML::Node& node, std::string_view path, const YAML::Node& value) {
  if (path.empty()) return value;
  const std::size_t dot = std::min(path.find('.'), path.size());
  const std::string key(path.substr(0, dot));
  const std::string_view rest = path.substr(std::min(dot + 1, path.size()));
  if (node.IsDefined() && node.IsSequence()) return with_entry(node, key, rest, value);
  YAML::Node out = empty_like(node, "{}");
  bool found = false;
  if (node.IsDefined() && node.IsMap()) {
    for (const auto& entry : node) {
      const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : "";
      if (excludes(key, name)) continue;
      found = found || name == key;
      const bool short_form = name == key && key == "protocol" && !rest.empty() && entry.second.IsScalar();  // its name alone
      const YAML::Node there = short_form ? with_value({}, "name", entry.second) : entry.second;
      out.force_insert(entry.first, name == key ? with_value(there, rest, value) : there);
    }
  }
  if (!found) out.force_insert(placed("'" + key + "'", value.Mark().line, value.Mark().column), with_value({}, rest, value));
  return out;
}

YAML::Node with_setting(const YAML::Node& document, const Setting& setting) {
  constexpr std::size_t kLongestKey = 200;
  if (setting.key.empty() || setting.key.size() > kLongestKey)
    throw ConfigError(fmt::format("sweep: found the key '{}'; allowed: one of this file, with dots, of up to {} characters",
                                  shown(setting.key), kLongestKey));
  try {
    return with_value(document, setting.key, placed(setting.value, setting.line, setting.column));
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", setting.key, error.what()));
  }
}

}  // namespace script
}  // namespace consort
