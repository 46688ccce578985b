#include "orchestrator/cli/completion.hpp"

#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/tables.hpp"
#include "orchestrator/cli/verbs.hpp"

#include "io/standard_streams.hpp"

#include <algorithm>
#include <sstream>

namespace consort {
namespace {

// "{a,b}" of "MODE:{a,b}".
std::vector<std::string> allowed_words(const std::string& type) {
  const std::size_t open = type.find(":{"), close = type.rfind('}');
  std::vector<std::string> words;
  if (open == std::string::npos || close == std::string::npos) return words;
  std::istringstream in(type.substr(open + 2, close - open - 2));
  for (std::string word; std::getline(in, word, ',');) words.push_back(word);
  return words;
}

Taken taken_by(const CLI::Option& option) {
  if (!option.get_positional() && option.get_items_expected_min() == 0) return {};
  const std::string type = option.get_type_name();
  if (auto words = allowed_words(type); !words.empty()) return {Taken::Kind::words, std::move(words)};
  if (type.find("METRIC") != std::string::npos) return {Taken::Kind::metrics, names_in("metrics")};
  if (type.starts_with("FILE")) return {Taken::Kind::files, {}};
  if (type == "DIR" || type == "A" || type == "B") return {Taken::Kind::folders, {}};
  return {Taken::Kind::text, {}};
}

// Its first sentence, or the first half of that.
std::string beginning_of(const std::string& text) {
  const std::size_t end = std::min({text.find(". "), text.find("; "), text.size()});
  return text.substr(0, text.ends_with('.') && end == text.size() ? end - 1 : end);
}

TypedOption typed_option(const CLI::Option& option) {
  TypedOption typed;
  for (const std::string& name : option.get_snames()) typed.names.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) typed.names.push_back("--" + name);
  typed.meaning = beginning_of(option.get_description());
  typed.value = taken_by(option);
  return typed;
}

class CompletionVerb : public Verb {
 public:
  explicit CompletionVerb(CLI::App& parent) : Verb(*parent.add_subcommand("completion", "")), consort_(parent) {
    document(app_,
             "print what completes this program's command line in a shell\n"
             "A script that completes verbs, options and what they take: files, folders, modes, metrics, and the names that `consort list` "
             "knows; and the options of consort-agent and consort-plant. An installation has it where the shells look.",
             {{"source <(consort completion bash)", "For this bash."},
              {"consort completion zsh >~/.zfunc/_consort", "Where zsh's fpath has that folder."},
              {"consort completion fish >~/.config/fish/completions/consort.fish", "For every fish."}},
             {{"0", "printed"}, {"2", "there is no completion for that shell"}});
    app_.add_option("shell", shell_, "Whose.")->required()->type_name("SHELL")->check(one_of({"bash", "zsh", "fish"}));
  }

  Exit execute() override {
    const auto verbs = typed_verbs(consort_);
    streams::put(shell_ == "bash" ? bash_completion(verbs) : shell_ == "zsh" ? zsh_completion(verbs) : fish_completion(verbs));
    return Exit::ok;
  }

 private:
  const CLI::App& consort_;
  std::string shell_;
};

}  // namespace

std::vector<TypedVerb> typed_verbs(const CLI::App& app) {
  std::vector<TypedVerb> verbs;
  for (const CLI::App* verb : app.get_subcommands({})) {
    const std::string& description = verb->get_description();
    TypedVerb typed{verb->get_name(), description.substr(0, description.find('\n')), {}, {}, {}};
    for (const CLI::Option* option : verb->get_options()) {
      if (option->get_positional())
        typed.arguments.push_back(taken_by(*option));
      else
        typed.options.push_back(typed_option(*option));
    }
    if (typed.name == "list")
      for (const std::string& list : typed.arguments.front().words) typed.after[list] = names_in(list);
    verbs.push_back(std::move(typed));
  }
  return verbs;
}

std::unique_ptr<Verb> make_completion_verb(CLI::App& parent) { return std::make_unique<CompletionVerb>(parent); }

}  // namespace consort
