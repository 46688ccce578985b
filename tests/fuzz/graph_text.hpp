#pragma once
/// A graph file: the first byte says which format, the rest is its text.

#include "orchestrator/script/graph_file.hpp"

#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>

namespace consort::fuzz {

/// Reads the text as a graph; true if it is one. Throws std::logic_error if a refusal says nothing or a graph has a self-loop; and whatever
/// the reader throws except GraphFileError.
inline bool read_graph_text(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return false;
  const auto endings = script::graph_file_endings();
  const std::string text(bytes.begin() + 1, bytes.end());
  try {
    const auto read = script::read_graph_file(text, endings[bytes[0] % endings.size()], std::nullopt, (bytes[0] & 0x80) != 0);
    for (const WeightedEdge& edge : read.graph.edges())
      if (edge.edge.from == edge.edge.to) throw std::logic_error("a graph with a self-loop");
    return true;
  } catch (const script::GraphFileError& refusal) {
    if (std::string(refusal.what()).size() < 10) throw std::logic_error("a refusal that says nothing");
    return false;
  }
}

}  // namespace consort::fuzz
