/// libFuzzer target: every decode function of the wire.

#include "tests/fuzz/wire_bytes.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  consort::fuzz::take_wire_bytes({data, size});
  return 0;
}
