#pragma once
/// Slips of the pen: why a text is no YAML, or is another than it looks like, named where the slip is. What the YAML library says of them
/// is its own way through the text, often some lines further on.

#include "orchestrator/script/yaml.hpp"

#include <string_view>

namespace consort::script {

/// Adds why `text`, which the library refused with `error`, is no YAML.
void explain(std::string_view text, const YAML::ParserException& error, Mistakes& mistakes);
/// Adds the keys of the document that were to be a key and a value: `rounds:50`, `rounds = 50`.
void check_keys(const YAML::Node& document, Mistakes& mistakes);

}  // namespace consort::script
