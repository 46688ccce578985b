#pragma once
/// Text as it may stand in an experiment file.

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

namespace consort::fuzz {

/// Reads the text as an experiment; true if it is one. Throws whatever the reader throws except ConfigError.
inline bool read_script(std::span<const std::uint8_t> bytes) {
  const std::string text(bytes.begin(), bytes.end());
  try {
    parse_experiment(text, "fuzzed.yaml", std::filesystem::temp_directory_path() / "consort-no-such-folder");
    return true;
  } catch (const ConfigError&) {
    return false;
  }
}

}  // namespace consort::fuzz
