#pragma once
/// A key of the experiment file and what stands there instead: `--set`, and the cells of a study.

#include "orchestrator/script/yaml.hpp"

#include <optional>
#include <string>
#include <string_view>

namespace consort {

struct Setting {
  std::string key;                    ///< such as agents.protocol.Q; entries of lists by their number, from 1: agents.protocols.2.Q
  std::string value;                  ///< as YAML, in one line
  std::string label;                  ///< what it is called in the names of metrics; empty: it is not swept
  std::optional<double> number = {};  ///< the value as a number, a duration in s; nullopt: it is not one
  int line = -1, column = -1;         ///< where the value stands in the file, from 0; -1: nowhere
};

/// "dt = 0.1", for messages and tables.
std::string shown(const Setting& setting);

namespace script {

/// `text` as a node whose place is line and column, from 0.
YAML::Node placed(const std::string& text, int line, int column);
/// A node as YAML in one line.
std::string one_line(const YAML::Node& node);

/// `node` with `value` at `path`; what is not on the way there is shared, what is there is copied, mappings that lack are made. A key that
/// excludes another (rounds, duration) replaces it. Throws ConfigError where a list has no such entry.
YAML::Node with_value(const YAML::Node& node, std::string_view path, const YAML::Node& value);

/// The document with what `setting` says.
YAML::Node with_setting(const YAML::Node& document, const Setting& setting);

}  // namespace script
}  // namespace consort
