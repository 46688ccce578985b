#include "agent/protocols/adaptive_consensus.hpp"
#include "agent/protocols/das_neural_consensus.hpp"
#include "agent/protocols/li_agent_consensus.hpp"
#include "agent/protocols/li_edge_consensus.hpp"
#include "agent/protocols/su_consensus.hpp"
#include "agent/protocols/yu_consensus.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> adaptive_protocols() {
  static const std::array table{
      entry<AdaptiveConsensus>(), entry<SuConsensus>(),      entry<YuConsensus>(),
      entry<LiEdgeConsensus>(),   entry<LiAgentConsensus>(), entry<DasNeuralConsensus>(),
  };
  return table;
}

}  // namespace consort
