#include "orchestrator/cli/completion.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string_view>

namespace consort {
namespace {

using Kind = Taken::Kind;

std::string joined(std::span<const std::string> words) { return fmt::format("{}", fmt::join(words, " ")); }

// For within '...' of a shell.
std::string quoted(std::string_view text, std::string_view quote) {
  std::string out;
  for (const char c : text) {
    if (c == '\'')
      out += quote;
    else
      out += c;
  }
  return out;
}

// --- bash -----------------------------------------------------------------------------------------------------------------

// What sets `kind` and `words` of _consort.
std::string bash_taken(const Taken& taken) {
  switch (taken.kind) {
    case Kind::words:
      return fmt::format("kind=words words='{}'", joined(taken.words));
    case Kind::metrics:
      return fmt::format("kind=metrics words='{}'", joined(taken.words));
    case Kind::files:
      return "kind=files";
    case Kind::folders:
      return "kind=folders";
    case Kind::text:
    case Kind::nothing:
      break;
  }
  return "kind=text";
}

constexpr std::string_view kBashWalk = R"(
_consort() {
  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD - 1]} verb=${COMP_WORDS[1]}
  local first= place=0 kind= words= i
  COMPREPLY=()
  if [[ $word == = ]]; then
    word=
  elif [[ $before == = ]]; then
    before=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  if ((COMP_CWORD == 1)); then
    kind=words words=$_consort_verbs
  elif ! _consort_value "$verb $before"; then
    for ((i = 2; i < COMP_CWORD; ++i)); do
      if [[ ${COMP_WORDS[i]} != -* ]] && ! _consort_value "$verb ${COMP_WORDS[i - 1]}"; then
        ((place++)) || first=${COMP_WORDS[i]}
      fi
    done
    kind= words=
    if [[ $word == -* ]]; then
      _consort_options "$verb"
    else
      _consort_argument "$verb $place $first"
    fi
  fi
  local IFS=$'\n'
  case $kind in
    words) COMPREPLY=($(compgen -W "${words// /$IFS}" -- "$word")) ;;
    metrics) compopt -o nospace 2>/dev/null; COMPREPLY=($(compgen -S = -W "${words// /$IFS}" -- "$word")) ;;
    files) compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -f -- "$word")) ;;
    folders) compopt -o filenames 2>/dev/null; COMPREPLY=($(compgen -d -- "$word")) ;;
  esac
}
_consort_process() {
  local options
  options=$("$1" --help 2>/dev/null | grep -oE -- '--[a-z][a-z-]*' | sort -u)
  COMPREPLY=($(compgen -W "$options" -- "${COMP_WORDS[COMP_CWORD]}"))
}
complete -F _consort consort
complete -F _consort_process consort-agent consort-plant
)";

std::string bash_arguments(const TypedVerb& verb) {
  std::string out;
  for (const auto& [first, words] : verb.after)
    out += fmt::format("    '{} '[1-9]*' {}') kind=words words='{}' ;;\n", verb.name, first, joined(words));
  for (std::size_t i = 0; i < verb.arguments.size(); ++i) {
    const bool last = i + 1 == verb.arguments.size();
    if (verb.arguments[i].kind != Kind::text)
      out += fmt::format("    '{} {}) {} ;;\n", verb.name, last ? "'*" : fmt::format("{} '*", i), bash_taken(verb.arguments[i]));
  }
  return out;
}

// --- zsh ------------------------------------------------------------------------------------------------------------------

std::string zsh_taken(const Taken& taken) {
  switch (taken.kind) {
    case Kind::words:
      return fmt::format("({})", joined(taken.words));
    case Kind::metrics:
      return fmt::format("{{compadd -S = -- {}}}", joined(taken.words));
    case Kind::files:
      return "_files";
    case Kind::folders:
      return "_files -/";
    case Kind::text:
    case Kind::nothing:
      break;
  }
  return " ";
}

// Of what _arguments of zsh takes for special.
std::string zsh_escaped(std::string_view text) {
  std::string out;
  for (const char c : quoted(text, "'\\''")) {
    if (c == '[' || c == ']' || c == ':') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_verb(const TypedVerb& verb) {
  std::string out = fmt::format("    {})\n", verb.name);
  for (const auto& [first, words] : verb.after) out += fmt::format("      [[ $words[2] == {} ]] && names=({})\n", first, joined(words));
  out += "      _arguments -S";
  for (const TypedOption& option : verb.options)
    for (const std::string& name : option.names) {
      out += fmt::format(" \\\n        '{}{}[{}]", option.names.size() > 1 ? fmt::format("({})", joined(option.names)) : "", name,
                         zsh_escaped(option.meaning));
      const bool takes = option.value.kind != Kind::nothing;
      out += takes ? fmt::format(":value:{}'", zsh_taken(option.value)) : "'";
      if (takes && name.starts_with("--")) out.insert(out.rfind("[" + zsh_escaped(option.meaning)), "=");
    }
  for (std::size_t i = 0; i < verb.arguments.size(); ++i) {
    const bool last = i + 1 == verb.arguments.size();
    const std::string taken = last && !verb.after.empty() ? "{compadd -a names}" : zsh_taken(verb.arguments[i]);
    out += fmt::format(" \\\n        '{}:argument:{}'", last ? "*" : std::to_string(i + 1), taken);
  }
  return out + "\n      ;;\n";
}

// --- fish -----------------------------------------------------------------------------------------------------------------

std::string fish_taken(const Taken& taken) {
  switch (taken.kind) {
    case Kind::words:
      return fmt::format(" -x -a '{}'", joined(taken.words));
    case Kind::metrics:
      return fmt::format(" -x -a '{}='", fmt::join(taken.words, "= "));
    case Kind::files:
      return " -r -F";
    case Kind::folders:
      return " -x -a '(__fish_complete_directories)'";
    case Kind::text:
      return " -x";
    case Kind::nothing:
      break;
  }
  return "";
}

std::string fish_verb(const TypedVerb& verb) {
  const auto described = [](const std::string& meaning) { return fmt::format(" -d '{}'", quoted(meaning, "\\'")); };
  std::string out = fmt::format("complete -c consort -n __consort_no_verb -a {}{}\n", verb.name, described(verb.meaning));
  const std::string here = fmt::format("complete -c consort -n '__consort_verb {}'", verb.name);
  for (const TypedOption& option : verb.options) {
    out += here;
    for (const std::string& name : option.names) out += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
    out += fish_taken(option.value) + described(option.meaning) + "\n";
  }
  for (const Taken& argument : verb.arguments) {
    if (argument.kind == Kind::files) out += here + " -F\n";
    if (argument.kind == Kind::folders) out += here + " -a '(__fish_complete_directories)'\n";
    if (argument.kind == Kind::words)
      out += fmt::format("complete -c consort -n '__consort_verb {}; and __consort_first' -a '{}'\n", verb.name, joined(argument.words));
  }
  for (const auto& [first, words] : verb.after)
    out += fmt::format("complete -c consort -n '__consort_verb {} {}' -a '{}'\n", verb.name, first, joined(words));
  return out;
}

constexpr std::string_view kFishBegin = R"fish(# fish completion of Consort; made by `consort completion fish`.
function __consort_no_verb
    test (count (commandline -opc)) -eq 1
end
function __consort_first
    test (count (commandline -opc)) -eq 2
end
# The verb, and the words that follow it.
function __consort_verb
    set -l typed (commandline -opc)
    set -l last (math (count $argv) + 1)
    test (count $typed) -ge $last; and test "$typed[2..$last]" = "$argv"
end
complete -c consort -f
complete -c consort -n __consort_no_verb -l help -s h -d 'Show the verbs'
complete -c consort -n __consort_no_verb -l version -d 'Show the version'
for program in consort-agent consort-plant
    complete -c $program -f -a "($program --help | string match -r -a -- '--[a-z][a-z-]*' | sort -u)"
end
)fish";

}  // namespace

std::string bash_completion(std::span<const TypedVerb> verbs) {
  std::string names, values, options, arguments;
  for (const TypedVerb& verb : verbs) {
    names += verb.name + " ";
    std::string all;
    for (const TypedOption& option : verb.options)
      for (const std::string& name : option.names) {
        all += all.empty() ? name : " " + name;
        if (option.value.kind != Kind::nothing) values += fmt::format("    '{} {}') {} ;;\n", verb.name, name, bash_taken(option.value));
      }
    options += fmt::format("    {}) words='{}' ;;\n", verb.name, all);
    arguments += bash_arguments(verb);
  }
  return fmt::format(
      "# bash completion of Consort; made by `consort completion bash`.\n"
      "_consort_verbs='{}--help --version'\n"
      "_consort_value() {{  # of an option of a verb, if it takes one\n  case $1 in\n{}    *) return 1 ;;\n  esac\n}}\n"
      "_consort_options() {{\n  kind=words\n  case $1 in\n{}  esac\n}}\n"
      "_consort_argument() {{  # of a verb, after so many, of which this is the first\n  case $1 in\n{}  esac\n}}{}",
      names, values, options, arguments, kBashWalk);
}

std::string zsh_completion(std::span<const TypedVerb> verbs) {
  std::string names, cases;
  for (const TypedVerb& verb : verbs) {
    names += fmt::format("    '{}:{}'\n", verb.name, zsh_escaped(verb.meaning));
    cases += zsh_verb(verb);
  }
  return fmt::format(
      "#compdef consort consort-agent consort-plant\n"
      "# zsh completion of Consort; made by `consort completion zsh`.\n"
      "if [[ $service != consort ]]; then\n  _arguments '*:argument: ' --\n  return\nfi\n"
      "local -a verbs names\n"
      "if ((CURRENT == 2)); then\n  verbs=(\n{}  )\n  _describe verb verbs\n"
      "  [[ $PREFIX == -* ]] && compadd -- --help --version\n  return\nfi\n"
      "shift words\n((CURRENT--))\ncase $words[1] in\n{}esac\n",
      names, cases);
}

std::string fish_completion(std::span<const TypedVerb> verbs) {
  std::string out(kFishBegin);
  for (const TypedVerb& verb : verbs) out += fish_verb(verb);
  return out;
}

}  // namespace consort
