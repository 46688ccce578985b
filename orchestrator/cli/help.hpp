#pragma once
/// Help as a manual page: what, usage, options with their defaults, examples, exit codes; 80 columns.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <string>
#include <utility>
#include <vector>

namespace consort {

class ManualPage : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
};

/// A command and what it does.
using Example = std::pair<std::string, std::string>;
/// Sets description (paragraphs), examples and exit codes of a verb.
void document(CLI::App& app, const std::string& description, const std::vector<Example>& examples, const std::vector<Example>& exit_codes);

/// Why `word` is none of these, with the nearest; empty if it is.
std::string refusal_of(const std::string& word, const std::vector<std::string>& words);
/// A check of an option that takes one of a few words; the refusal names them. Completion reads them from the option's type.
CLI::Validator one_of(std::vector<std::string> words);

}  // namespace consort
