#pragma once
/// The project's own text as the tidy tests see it: files with their room, lines, includes, and code without comments and strings.

#include <algorithm>
#include <cctype>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace consort::tidy {

inline bool starts_with_any(std::string_view text, std::initializer_list<std::string_view> prefixes) {
  return std::any_of(prefixes.begin(), prefixes.end(), [&](std::string_view prefix) { return text.starts_with(prefix); });
}

inline bool ends_with_any(std::string_view text, std::initializer_list<std::string_view> suffixes) {
  return std::any_of(suffixes.begin(), suffixes.end(), [&](std::string_view suffix) { return text.ends_with(suffix); });
}

inline std::vector<std::string> lines_of(std::string_view text) {
  std::vector<std::string> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    lines.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return lines;
}

/// How many characters a line has: bytes that continue one in UTF-8 are none of their own.
inline std::size_t characters(std::string_view line) {
  const auto begins = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; };
  return static_cast<std::size_t>(std::count_if(line.begin(), line.end(), begins));
}

/// C++ text with comments, string and character literals blanked out; line breaks stay, so line numbers do too. `strings`: gets what was
/// blanked out of literals, quotes and all, and where it began.
inline std::string code_of(std::string_view text, std::vector<std::pair<std::size_t, std::string>>* strings = nullptr) {
  std::string code(text);
  std::size_t at = 0;
  const auto keep = [&](std::size_t end) {
    if (strings != nullptr) strings->emplace_back(at, text.substr(at, end - at));
    return end;
  };
  const auto blank_to = [&](std::size_t end) {
    for (end = std::min(end, code.size()); at < end; ++at)
      if (code[at] != '\n') code[at] = ' ';
  };
  const auto after = [&](std::string_view what, std::size_t from) {
    const std::size_t found = text.find(what, from);
    return found == std::string_view::npos ? text.size() : found + what.size();
  };
  const auto literal_end = [&](char quote) {
    std::size_t end = at + 1;
    while (end < text.size() && text[end] != quote && text[end] != '\n') end += text[end] == '\\' ? 2 : 1;
    return end + 1;
  };
  while (at < text.size()) {
    const std::string_view rest = text.substr(at);
    const bool in_word = at > 0 && (std::isalnum(static_cast<unsigned char>(text[at - 1])) != 0 || text[at - 1] == '_');
    if (rest.starts_with("//")) {
      blank_to(std::min(text.find('\n', at), text.size()));
    } else if (rest.starts_with("/*")) {
      blank_to(after("*/", at));
    } else if (rest.starts_with("R\"") && !in_word) {
      const std::string delimiter(text.substr(at + 2, text.find('(', at) - at - 2));
      blank_to(keep(after(")" + delimiter + "\"", at)));
    } else if (text[at] == '"' || (text[at] == '\'' && !in_word)) {  // a quote inside a word separates digits
      blank_to(keep(literal_end(text[at])));
    } else {
      ++at;
    }
  }
  return code;
}

struct SourceFile {
  std::string path;  ///< relative to the project, with '/'
  std::string text;

  [[nodiscard]] std::string name() const { return path.substr(path.rfind('/') + 1); }
  [[nodiscard]] bool header() const { return ends_with_any(path, {".hpp", ".h"}); }
  [[nodiscard]] bool cpp() const { return header() || ends_with_any(path, {".cpp", ".c"}); }
  [[nodiscard]] bool test() const { return path.starts_with("tests/"); }

  struct Include {
    std::size_t line = 0;
    std::string what;  ///< without quotes or brackets
  };
  [[nodiscard]] std::vector<Include> includes() const {
    std::vector<Include> found;
    const std::vector<std::string> lines = lines_of(text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (!lines[i].starts_with("#include")) continue;
      const std::size_t open = lines[i].find_first_of("\"<");
      const std::size_t close = lines[i].find_last_of("\">");
      if (open != std::string::npos && close > open) found.push_back({i + 1, lines[i].substr(open + 1, close - open - 1)});
    }
    return found;
  }
};

inline std::string text_in(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error("cannot read " + file.string());
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Every text file of the project that people write, ascending by path. Build trees, results and what the user has lying around are not
/// seen.
inline std::vector<SourceFile> source_tree(const std::filesystem::path& root) {
  namespace fs = std::filesystem;
  std::vector<fs::path> found;
  const auto wanted = [](const fs::path& file) {
    const std::string name = file.filename().string();
    return name == "CMakeLists.txt" || name == "Makefile" ||
           ends_with_any(name, {".cpp", ".hpp", ".c", ".cmake", ".h", ".idl", ".yaml", ".yml", ".json", ".md", ".sh", ".bib", ".xml",
                                ".service", ".gp"});
  };
  for (const char* room : {".github", "agent", "cmake", "core", "dds", "deploy", "docs", "experiments", "idl", "io", "models",
                           "orchestrator", "plant", "process", "protocols", "rounds", "tests"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / room))
      if (entry.is_regular_file() && wanted(entry.path())) found.push_back(entry.path());
  for (const fs::directory_entry& entry : fs::directory_iterator(root))
    if (entry.is_regular_file() && wanted(entry.path())) found.push_back(entry.path());
  std::sort(found.begin(), found.end());

  std::vector<SourceFile> files;
  for (const fs::path& file : found) files.push_back({fs::relative(file, root).generic_string(), text_in(file)});
  return files;
}

}  // namespace consort::tidy
