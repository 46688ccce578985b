#pragma once
/// What stands in a file.

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace consort {

inline std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace consort
