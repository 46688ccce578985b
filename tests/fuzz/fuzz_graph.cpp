/// libFuzzer target: the readers of graphs in files of other programs.

#include "tests/fuzz/graph_text.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  consort::fuzz::read_graph_text({data, size});
  return 0;
}
