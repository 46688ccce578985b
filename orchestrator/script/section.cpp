#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace consort::script {

void check_duplicate_keys(Mistakes& mistakes, const YAML::Node& node) {
  if (node.IsSequence())
    for (const auto& entry : node) check_duplicate_keys(mistakes, entry);
  if (!node.IsMap()) return;
  std::map<std::string, YAML::Mark> seen;
  for (const auto& entry : node) {
    if (entry.first.IsScalar()) {
      const auto [it, fresh] = seen.emplace(entry.first.Scalar(), entry.first.Mark());
      if (!fresh)
        mistakes.add(entry.first, fmt::format("found the key '{}' a second time (first in line {}); allowed: each key once",
                                              shown(it->first), it->second.line + 1));
    }
    check_duplicate_keys(mistakes, entry.second);
  }
}

namespace {

// What an unknown key may have been meant to be, or where it belongs.
std::string misplaced(const std::string& key, std::span<const std::string> allowed) {
  const auto top = schema_keys("");
  if (std::find(top.begin(), top.end(), key) != top.end()) return "; it belongs at the top level, with no spaces before it";
  return did_you_mean(key, allowed);
}

}  // namespace

Section::Section(Mistakes& mistakes, const YAML::Node& node, std::string what, std::string_view schema_pointer)
    : mistakes_(mistakes), node_(node), what_(std::move(what)), is_map_(node.IsDefined() && node.IsMap()) {
  mistakes_.at(node_.Mark());
  const auto keys = schema_keys(schema_pointer);
  const std::string name = what_.empty() ? "the experiment" : what_;
  if (!is_map_) {
    mistakes_.add(node_, fmt::format("{}: found {}; allowed: a mapping with the keys {}", name, describe(node_), listed(keys)));
    return;
  }
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) {
      mistakes_.add(entry.first, fmt::format("{}: found {} as a key; allowed: {}", name, describe(entry.first), listed(keys)));
    } else if (const std::string& key = entry.first.Scalar(); std::find(keys.begin(), keys.end(), key) == keys.end()) {
      if (what_.empty() && key.starts_with("x-")) continue;  // holds anchors for the rest of the file
      mistakes_.add(entry.first, fmt::format("{}: found the unknown key '{}'; allowed: {}{}{}", name, shown(key), listed(keys),
                                             what_.empty() ? ", x-... for anchors" : "", misplaced(key, keys)));
    }
  }
}

YAML::Node Section::find(const std::string& key) const { return is_map_ ? node_[key] : YAML::Node(YAML::NodeType::Undefined); }

YAML::Node Section::required(const std::string& key) const {
  const YAML::Node found = find(key);
  if (is_map_ && !found.IsDefined())
    mistakes_.add(node_, fmt::format("{}: found no '{}'; allowed: it must be given", what_.empty() ? "the experiment" : what_, key));
  return found;
}

}  // namespace consort::script
