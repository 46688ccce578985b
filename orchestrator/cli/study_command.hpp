#pragma once
/// The part of `consort run` that is about studies: its options, and what they ask for.

#include "core/errors.hpp"
#include "orchestrator/cli/study.hpp"

#include <CLI/App.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace consort {

/// What `consort run` was told beside.
struct StudySetting {
  std::filesystem::path file, output;  ///< empty: not given
  ScriptOverrides overrides = {};
  std::vector<std::string> command_line;
  bool force = false, no_report = false, quiet = false;
};

using Show = std::function<void(const std::string& text, const std::string& json)>;

/// Shows what was collected of a study: table, criteria, and where it lies.
Exit show_study(const Collected& collected, const Show& show);

class StudyCommand {
 public:
  void add_options(CLI::App& app);
  [[nodiscard]] bool resumes() const { return !folder_.empty(); }
  /// Is the file with this text to be run as a study? If not, `overrides` has what `--set` says.
  bool is_study(const std::string& text, const std::string& name, ScriptOverrides& overrides) const;
  /// Runs it, or what of it is asked for. Of a study that is resumed there is no text.
  Exit execute(const StudySetting& setting, const std::string& text, const Show& show) const;

 private:
  [[nodiscard]] std::filesystem::path begin(const StudySetting& setting, const std::string& text) const;
  [[nodiscard]] Exit run_one(const std::filesystem::path& folder, const Show& show) const;

  std::filesystem::path folder_;  // of --resume
  std::vector<std::string> sets_;
  std::optional<std::size_t> jobs_, cell_;
  bool zipped_ = false, plan_only_ = false, full_ = false, fail_fast_ = false, keep_going_ = false;
};

}  // namespace consort
