#include "protocols/filters/dkf_iterative.hpp"
#include "protocols/filters/dkf_kim.hpp"
#include "protocols/filters/dkf_olfati_saber.hpp"
#include "protocols/filters/dlo_kim.hpp"
#include "protocols/filters/dlo_zhang.hpp"
#include "protocols/filters/kalman_bucy.hpp"
#include "protocols/registry_entry.hpp"

namespace consort {

std::span<const ProtocolEntry> filters_protocols() {
  static const std::array table{
      entry<KalmanBucy>(), entry<DkfOlfatiSaber>(), entry<DkfIterative>(), entry<DkfKim>(), entry<DloKim>(), entry<DloZhang>(),
  };
  return table;
}

}  // namespace consort
