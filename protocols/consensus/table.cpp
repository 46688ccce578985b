#include "protocols/consensus/continuous_kalman_consensus.hpp"
#include "protocols/consensus/kalman_consensus.hpp"
#include "protocols/consensus/local_voting.hpp"
#include "protocols/consensus/robust_information_consensus.hpp"
#include "protocols/consensus/unbiased_information_consensus.hpp"
#include "protocols/consensus/unbiased_kalman_consensus.hpp"
#include "protocols/registry_entry.hpp"

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
