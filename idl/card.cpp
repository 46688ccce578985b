#include "idl/card.hpp"

#include "core/build.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <sstream>

namespace consort::wire {
namespace {

constexpr const char* kFirstLine = "consort card";
constexpr std::size_t kLongestValue = 200;

// Fit to be shown: from somebody who may be anybody.
std::string harmless(std::string_view text) {
  std::string result(text.substr(0, kLongestValue));
  std::replace_if(
      result.begin(), result.end(), [](unsigned char c) { return c < ' ' || c > '~'; }, '?');
  return result;
}

// 0.10 of 0.10.2
std::string_view without_patch(std::string_view version) {
  const std::size_t minor = version.find('.');
  return minor == std::string_view::npos ? version : version.substr(0, version.find('.', minor + 1));
}

}  // namespace

Build Build::own() {
  const bool known = kBuild.commit != "unknown";  // where there was no git
  return {CONSORT_VERSION, CONSORT_WIRE, CONSORT_CYCLONE_VERSION, known ? std::string(kBuild.commit) : std::string()};
}

bool Build::fits(const Build& other) const {
  return program == other.program && wire == other.wire && without_patch(cyclone) == without_patch(other.cyclone);
}

bool Build::same_sources(const Build& other) const { return commit.empty() || other.commit.empty() || commit == other.commit; }

std::string Build::text() const { return "Consort " + program + " (wire " + wire + ", Cyclone DDS " + cyclone + ")"; }

Build Build::from_word(const std::string& word) {
  Build build;
  std::istringstream in(word);
  for (std::string* part : {&build.program, &build.wire, &build.cyclone, &build.commit}) std::getline(in, *part, '/');
  return build;
}

std::vector<unsigned char> Card::bytes() const {
  const std::string text = std::string(kFirstLine) + "\nrole=" + role + "\nprogram=" + build.program + "\nwire=" + build.wire +
                           "\ncyclone=" + build.cyclone + "\ncommit=" + build.commit + "\nids=" + ids.substr(0, kLongestValue) + "\n";
  return {text.begin(), text.end()};
}

std::optional<Card> Card::of(std::span<const unsigned char> bytes) {
  std::istringstream in(std::string(bytes.begin(), bytes.end()));
  std::string line;
  if (!std::getline(in, line) || line != kFirstLine) return std::nullopt;
  Card card;
  const std::array<std::pair<std::string_view, std::string*>, 6> fields{{{"role", &card.role},
                                                                         {"program", &card.build.program},
                                                                         {"wire", &card.build.wire},
                                                                         {"cyclone", &card.build.cyclone},
                                                                         {"commit", &card.build.commit},
                                                                         {"ids", &card.ids}}};
  while (std::getline(in, line)) {
    const std::size_t equals = line.find('=');
    if (equals == std::string::npos) continue;
    for (const auto& [name, value] : fields)
      if (std::string_view(line).substr(0, equals) == name) *value = harmless(std::string_view(line).substr(equals + 1));
  }
  return card;
}

}  // namespace consort::wire
