#include "orchestrator/cli/help.hpp"

#include "orchestrator/report/terminal.hpp"
#include "orchestrator/script/wording.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <sstream>
#include <utility>

namespace consort {
namespace {

constexpr std::size_t kLineWidth = 80, kMargin = 4, kNameWidth = 22;

std::string indented(const std::string& text, std::size_t margin) {
  std::string out;
  std::istringstream paragraphs(text);
  for (std::string paragraph; std::getline(paragraphs, paragraph);) {
    for (const auto& line : wrapped(paragraph, kLineWidth - margin)) out += line.empty() ? "\n" : std::string(margin, ' ') + line + "\n";
  }
  return out;
}

// A name and, beside or below it, what it means.
std::string entry(const std::string& name, const std::string& meaning) {
  std::string out = std::string(kMargin, ' ') + name;
  const std::size_t column = kMargin + kNameWidth;
  const bool fits = shown_width(name) + 2 <= kNameWidth;
  out += fits ? std::string(kNameWidth - shown_width(name), ' ') : "\n" + std::string(column, ' ');
  const auto lines = wrapped(meaning, kLineWidth - column);
  for (std::size_t i = 0; i < lines.size(); ++i) out += (i == 0 ? "" : std::string(column, ' ')) + lines[i] + "\n";
  return out;
}

// What a check allows stands behind the colon.
std::string type_of(const CLI::Option& option) { return option.get_type_name().substr(0, option.get_type_name().find(':')); }

std::string option_text(const CLI::Option& option) {
  const std::string name = option.get_positional() ? option.get_name(true) : option.get_name(false, true);
  const std::string type = type_of(option);
  std::string shown = option.get_positional() ? type : name;
  if (!option.get_positional() && option.get_type_size() != 0) shown += " " + type;
  std::string meaning = option.get_description();
  if (!option.get_default_str().empty()) meaning += " Default: " + option.get_default_str() + ".";
  return entry(shown, meaning);
}

}  // namespace

std::string ManualPage::make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const {
  std::string name = app->get_name();
  for (const CLI::App* parent = app->get_parent(); parent != nullptr; parent = parent->get_parent()) name = parent->get_name() + " " + name;
  std::string positionals, options, verbs, usage = name;
  for (const CLI::Option* option : app->get_options()) {
    if (option->get_positional()) {
      positionals += option_text(*option);
      usage += option->get_required() ? " " + type_of(*option) : " [" + type_of(*option) + "]";
    } else {
      options += option_text(*option);
    }
  }
  for (const CLI::App* verb : app->get_subcommands({})) {
    const std::string& description = verb->get_description();
    verbs += entry(verb->get_name(), description.substr(0, description.find('\n')));
  }
  if (!verbs.empty()) usage += " VERB ...";
  std::string out = "NAME\n" + indented(name + " - " + app->get_description().substr(0, app->get_description().find('\n')), kMargin);
  out += "\nUSAGE\n" + indented(usage + (options.empty() ? "" : " [options]"), kMargin);
  const std::size_t more = app->get_description().find('\n');
  if (more != std::string::npos) out += "\nDESCRIPTION\n" + indented(app->get_description().substr(more + 1), kMargin);
  if (!positionals.empty()) out += "\nARGUMENTS\n" + positionals;
  if (!verbs.empty()) out += "\nVERBS\n" + verbs;
  if (!options.empty()) out += "\nOPTIONS\n" + options;
  return out + app->get_footer();
}

void document(CLI::App& app, const std::string& description, const std::vector<Example>& examples, const std::vector<Example>& exit_codes) {
  app.description(description);
  std::string footer = "\nEXAMPLES\n";
  for (const auto& [command, meaning] : examples) footer += std::string(kMargin, ' ') + command + "\n" + indented(meaning, kMargin + 4);
  footer += "\nEXIT CODES\n";
  for (const auto& [code, meaning] : exit_codes) footer += entry(code, meaning);
  app.footer(footer);
}

std::string refusal_of(const std::string& word, const std::vector<std::string>& words) {
  if (std::find(words.begin(), words.end(), word) != words.end()) return {};
  return fmt::format("found '{}'; allowed: {}{}", word, listed(words), did_you_mean(word, words));
}

CLI::Validator one_of(std::vector<std::string> words) {
  std::string type = fmt::format("{{{}}}", fmt::join(words, ","));
  return {[words = std::move(words)](const std::string& word) { return refusal_of(word, words); }, std::move(type)};
}

}  // namespace consort
