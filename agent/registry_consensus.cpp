#include "agent/protocols/continuous_kalman_consensus.hpp"
#include "agent/protocols/kalman_consensus.hpp"
#include "agent/protocols/local_voting.hpp"
#include "agent/protocols/robust_information_consensus.hpp"
#include "agent/protocols/unbiased_information_consensus.hpp"
#include "agent/protocols/unbiased_kalman_consensus.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> consensus_protocols() {
  static const std::array table{
      entry<LocalVoting>(),
      entry<KalmanConsensus>(),
      entry<ContinuousKalmanConsensus>(),
      entry<UnbiasedKalmanConsensus>(),
      entry<UnbiasedInformationConsensus>(),
      entry<RobustInformationConsensus>(),
  };
  return table;
}

}  // namespace consort
