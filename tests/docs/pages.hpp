#pragma once
/// The pages that people read, as a test sees them: their fenced blocks, in order.

#include "tests/support/program.hpp"

#include <algorithm>
#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

namespace consort::docs {

struct Block {
  std::size_t line = 0;  ///< of its first line within
  std::string language;  ///< "sh": every line is typed; "console": lines after "$ " are, the others are what comes; "yaml": an experiment
  std::string title;     ///< shown above it; says what is special: "not tested: why", "exit code 2", or the file's name
  std::string text;

  [[nodiscard]] bool shell() const { return language == "sh" || language == "console"; }
  [[nodiscard]] bool run() const { return shell() && !title.starts_with("not tested: "); }
  /// What a reader is shown, but for what "…" leaves out.
  [[nodiscard]] std::vector<std::string> shown() const {
    std::istringstream lines(text);
    std::vector<std::string> shown;
    for (std::string row; language == "console" && std::getline(lines, row);)
      if (!row.empty() && !row.starts_with("$ ") && row.find("…") == std::string::npos) shown.push_back(row);
    return shown;
  }
  /// What a reader types.
  [[nodiscard]] std::string typed() const {
    if (language == "sh") return text;
    std::istringstream lines(text);
    std::string typed;
    for (std::string row; std::getline(lines, row);)
      if (row.starts_with("$ ")) typed += row.substr(2) + "\n";
    return typed;
  }
};

inline std::vector<Block> blocks_of(const std::string& page) {
  std::istringstream lines(page);
  std::vector<Block> blocks;
  bool inside = false;
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (!line.starts_with("```")) {
      if (inside) blocks.back().text += line + "\n";
      continue;
    }
    inside = !inside;
    if (!inside) continue;
    const std::size_t quote = line.find(" title=\"");
    const std::size_t title = quote == std::string::npos ? quote : quote + 8;
    blocks.push_back({number + 1, line.substr(3, line.find(' ') - 3),
                      title == std::string::npos ? "" : line.substr(title, line.rfind('"') - title), ""});
  }
  return blocks;
}

/// README, the guide and the page on continuous integration, relative to the project; ascending.
inline std::vector<std::string> pages() {
  std::vector<std::string> found{"README.md", "docs/ci.md"};
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "docs/guide"))
    found.push_back("docs/guide/" + entry.path().filename().string());
  std::sort(found.begin(), found.end());
  return found;
}

inline std::vector<Block> blocks_in(const std::string& page) { return blocks_of(text_of(std::filesystem::path(kSourceDir) / page)); }

}  // namespace consort::docs
