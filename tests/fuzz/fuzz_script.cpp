/// libFuzzer target: the reader of experiment files.

#include "tests/fuzz/script_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  consort::fuzz::read_script({data, size});
  return 0;
}
