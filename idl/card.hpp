#pragma once
/// What a process of a run says of itself to whoever takes part in the same domain: in its participant's USER_DATA, so that it needs no
/// topic of ours, no key and no build in common to be read. It proves nothing; it is there to name a mistake to both who made it.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace consort::wire {

/// Of what a program was made.
struct Build {
  std::string program, wire, cyclone;  ///< version of Consort; number of the IDL; version of Cyclone DDS
  std::string commit = {};             ///< of its sources; empty: it does not say

  static Build own();
  /// May processes of the two builds take part in one run? Cyclone's patch level may differ.
  [[nodiscard]] bool fits(const Build& other) const;
  /// Is neither known to be made of other sources than the other? Else they understand each other, but may compute differently.
  [[nodiscard]] bool same_sources(const Build& other) const;
  [[nodiscard]] std::string text() const;  ///< for a person
  /// As text() wrote it for another program's command line: "1.0/1a2b3c4d/0.10.2/0123456789ab".
  [[nodiscard]] std::string word() const { return program + "/" + wire + "/" + cyclone + "/" + commit; }
  static Build from_word(const std::string& word);

  bool operator==(const Build&) const = default;
};

struct Card {
  std::string role;  ///< consort, consort-agent, consort-plant
  Build build;
  std::string ids = {};  ///< of the agents it hosts: 1-3,7

  [[nodiscard]] std::vector<unsigned char> bytes() const;
  /// Of what another participant shows; nothing if that is no card. Fields that are not known are left alone, so a card may grow.
  static std::optional<Card> of(std::span<const unsigned char> bytes);
};

/// A participant behind an endpoint, as far as discovery knows it.
struct Sender {
  std::string guid;  ///< 32 hexadecimal digits; empty: unknown
  std::string who;   ///< its process, for a person; empty: unknown
  std::optional<Card> card;
};

}  // namespace consort::wire
