#pragma once
/// The table of protocols: one visible line each in registry.cpp.

#include "agent/protocol.hpp"

#include <memory>
#include <span>
#include <string_view>

namespace consort {

struct ProtocolEntry {
  std::string_view name;
  std::string_view summary;      ///< one line
  std::string_view source;       ///< authors, year, equations
  std::string_view assumptions;  ///< what theory asks for, one line
  std::span<const ValueDoc> parameters;
  std::span<const ValueDoc> initial;
  /// Throws ConfigError (naming parameter, what was found, what is allowed).
  std::unique_ptr<Protocol> (*make)(const Values& parameters, const Setup& setup);
};

std::span<const ProtocolEntry> protocol_table();
/// Throws ConfigError naming the nearest match.
const ProtocolEntry& find_protocol(std::string_view name);

}  // namespace consort
