#pragma once
/// The verbs of `consort`. Each adds itself to the command line and knows how to run; only `main` catches what they throw.

#include "core/errors.hpp"

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <memory>
#include <string>
#include <vector>

namespace consort {

/// One line on standard error.
void say(const std::string& text);

class Verb {
 public:
  explicit Verb(CLI::App& app) : app_(app) {}
  virtual ~Verb() = default;
  [[nodiscard]] const CLI::App& app() const { return app_; }
  virtual Exit execute() = 0;
  /// An exception ended execute(): leaves what is known on disk and on the terminal, and says with which code to end.
  /// Where --json was asked for, it is answered: {"exit": ..., "error": ...}.
  virtual Exit abandon(Exit exit, const std::string& error);

 protected:
  /// --json and --quiet, with what they mean here.
  void add_output_flags(const std::string& json, const std::string& quiet);
  /// What was asked for, on standard output: `json` with --json, else `text`, unless --quiet was asked for.
  void show(const std::string& text, const std::string& json) const;

  CLI::App& app_;
  bool json_ = false, quiet_ = false;
};

std::unique_ptr<Verb> make_run_verb(CLI::App& parent, std::vector<std::string> command_line);
std::unique_ptr<Verb> make_validate_verb(CLI::App& parent);
std::unique_ptr<Verb> make_graph_verb(CLI::App& parent);
std::unique_ptr<Verb> make_list_verb(CLI::App& parent);
std::unique_ptr<Verb> make_doctor_verb(CLI::App& parent);
std::unique_ptr<Verb> make_export_verb(CLI::App& parent);
std::unique_ptr<Verb> make_lend_verb(CLI::App& parent);
std::unique_ptr<Verb> make_completion_verb(CLI::App& parent);
std::unique_ptr<Verb> make_report_verb(CLI::App& parent);
std::unique_ptr<Verb> make_watch_verb(CLI::App& parent);
std::unique_ptr<Verb> make_diff_verb(CLI::App& parent);
std::unique_ptr<Verb> make_replay_verb(CLI::App& parent);
std::unique_ptr<Verb> make_test_verb(CLI::App& parent);
std::unique_ptr<Verb> make_collect_verb(CLI::App& parent);
std::unique_ptr<Verb> make_results_verb(CLI::App& parent);

/// In whatever shows pages here; nothing happens where nothing does.
void open_browser(const std::string& address);

/// `consort` as a whole: parses, then runs the verb that was asked for.
class CommandLine {
 public:
  CommandLine(int argc, const char* const* argv);
  Exit execute();                                 ///< throws CLI::ParseError, or what the verb throws
  int answer(const CLI::ParseError& stop);        ///< help and version: 0; a mistake on the command line: 2 and a word on standard error
  int fail(Exit exit, const std::string& error);  ///< for an exception of the verb: says so and returns the exit code

 private:
  std::vector<std::string> words_;
  CLI::App app_;
  std::vector<std::unique_ptr<Verb>> verbs_;
};

}  // namespace consort
