#pragma once
/// What may be typed after `consort`, read from its parser, and how bash, zsh and fish are told.

#include <CLI/App.hpp>
#include <CLI/Config.hpp>
#include <CLI/Formatter.hpp>

#include <map>
#include <span>
#include <string>
#include <vector>

namespace consort {

/// What an option or an argument takes.
struct Taken {
  enum class Kind { nothing, text, words, metrics, files, folders };  ///< text: of one's own; metrics: METRIC=...
  Kind kind = Kind::nothing;
  std::vector<std::string> words;  ///< of words and metrics
};

struct TypedOption {
  std::vector<std::string> names;  ///< with their dashes, the longest last
  std::string meaning;             ///< its first sentence
  Taken value;
};

struct TypedVerb {
  std::string name, meaning;
  std::vector<TypedOption> options;
  std::vector<Taken> arguments;                           ///< in their order; the last may be repeated
  std::map<std::string, std::vector<std::string>> after;  ///< the words that follow this first argument
};

/// Of every verb of `app`. What `list` can name follows its lists.
std::vector<TypedVerb> typed_verbs(const CLI::App& app);

/// A script for the shell, which completes verbs, options, words, metrics, files and folders; and options of the other two programs.
std::string bash_completion(std::span<const TypedVerb> verbs);
std::string zsh_completion(std::span<const TypedVerb> verbs);
std::string fish_completion(std::span<const TypedVerb> verbs);

}  // namespace consort
