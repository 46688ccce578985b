/// Writes valid wire inputs into a folder, for a fuzzer to begin with: seeds FOLDER

#include "tests/fuzz/wire_bytes.hpp"

#include <cstdio>
#include <filesystem>
#include <fstream>

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: seeds FOLDER\n");
    return 2;
  }
  std::filesystem::create_directories(argv[1]);
  std::size_t number = 0;
  for (const auto& seed : consort::fuzz::wire_seeds()) {
    std::ofstream out(std::filesystem::path(argv[1]) / ("seed-" + std::to_string(number++)), std::ios::binary);
    out.write(reinterpret_cast<const char*>(seed.data()), static_cast<std::streamsize>(seed.size()));
    if (!out) return 1;
  }
  return 0;
}
