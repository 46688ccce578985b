#include "agent/protocols/dkf_iterative.hpp"
#include "agent/protocols/dkf_kim.hpp"
#include "agent/protocols/dkf_olfati_saber.hpp"
#include "agent/protocols/dlo_kim.hpp"
#include "agent/protocols/dlo_zhang.hpp"
#include "agent/protocols/kalman_bucy.hpp"
#include "agent/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> filters_protocols() {
  static const std::array table{
      entry<KalmanBucy>(), entry<DkfOlfatiSaber>(), entry<DkfIterative>(), entry<DkfKim>(), entry<DloKim>(), entry<DloZhang>(),
  };
  return table;
}

}  // namespace consort
