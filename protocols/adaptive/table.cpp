#include "protocols/adaptive/adaptive_consensus.hpp"
#include "protocols/adaptive/das_neural_consensus.hpp"
#include "protocols/adaptive/li_agent_consensus.hpp"
#include "protocols/adaptive/li_edge_consensus.hpp"
#include "protocols/adaptive/su_consensus.hpp"
#include "protocols/adaptive/yu_consensus.hpp"
#include "protocols/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> adaptive_protocols() {
  static const std::array table{
      entry<AdaptiveConsensus>(), entry<SuConsensus>(),      entry<YuConsensus>(),
      entry<LiEdgeConsensus>(),   entry<LiAgentConsensus>(), entry<DasNeuralConsensus>(),
  };
  return table;
}

}  // namespace consort
