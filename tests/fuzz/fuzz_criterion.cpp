/// libFuzzer target: the reader of acceptance criteria.

#include "tests/fuzz/criterion_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  consort::fuzz::read_criterion({data, size});
  return 0;
}
