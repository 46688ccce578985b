#pragma once
/// From the text of an experiment file to its YAML document, within bounds: what could take for ever to walk, or would be read as something
/// else than it looks like, is refused at its place before there is a document.

#include "orchestrator/script/yaml.hpp"

#include <string>

namespace consort::script {

inline constexpr std::size_t kMostNodes = 2'000'000;  ///< values, lists, mappings and keys as they are written
inline constexpr std::size_t kMostAliased = 100'000;  ///< what aliases stand for, all together, in nodes
inline constexpr std::size_t kDeepest = 64;           ///< lists and mappings within each other, with aliases in place

/// `bytes` without a byte order mark and with plain ends of lines, whichever of the three (CR LF, LF, CR) it has.
std::string plain_text(const std::string& bytes);
/// The document of a plain text, with `<<` keys merged into their mappings. What keeps it from being one is added to `mistakes`.
YAML::Node read_document(const std::string& text, Mistakes& mistakes);

}  // namespace consort::script
