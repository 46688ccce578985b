/// What fuzzing has found stays found: every file of the corpus goes through the fuzz targets' own functions, in every build.

#include "tests/fuzz/criterion_text.hpp"
#include "tests/fuzz/graph_text.hpp"
#include "tests/fuzz/script_text.hpp"
#include "tests/fuzz/wire_bytes.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

namespace consort::fuzz {
namespace {

template <class Use>
std::size_t every_file(const std::string& corpus, Use&& use) {
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "tests/fuzz/corpus" / corpus)) {
    SCOPED_TRACE(entry.path().filename());
    std::ifstream in(entry.path(), std::ios::binary);
    const std::vector<char> text((std::istreambuf_iterator<char>(in)), {});
    const std::vector<std::uint8_t> bytes(text.begin(), text.end());
    EXPECT_NO_THROW(use(bytes));
    ++files;
  }
  return files;
}

TEST(Corpus, NoBytesFromTheNetworkDoMoreThanBeRejected) {
  std::set<Fate> fates;
  EXPECT_GE(every_file("wire", [&](const std::vector<std::uint8_t>& bytes) { fates.insert(take_wire_bytes(bytes)); }), 20u);
  EXPECT_EQ(fates.size(), 3u) << "the corpus reaches every fate";
}

TEST(Corpus, NoExperimentFileDoesMoreThanBeRefused) {
  std::set<bool> fates;
  EXPECT_GE(every_file("script", [&](const std::vector<std::uint8_t>& bytes) { fates.insert(read_script(bytes)); }), 20u);
  EXPECT_EQ(fates.size(), 2u) << "some are experiments";
}

TEST(Corpus, NoCriterionDoesMoreThanBeRefused) {
  std::set<bool> fates;
  EXPECT_GE(every_file("criterion", [&](const std::vector<std::uint8_t>& bytes) { fates.insert(read_criterion(bytes)); }), 20u);
  EXPECT_EQ(fates.size(), 2u) << "some are criteria";
}

TEST(Corpus, NoGraphFileDoesMoreThanBeRefused) {
  std::set<bool> fates;
  EXPECT_GE(every_file("graph", [&](const std::vector<std::uint8_t>& bytes) { fates.insert(read_graph_text(bytes)); }), 20u);
  EXPECT_EQ(fates.size(), 2u) << "some are graphs";
}

TEST(Corpus, TheSeedsOfEveryTopicAreDecoded) {
  const auto seeds = wire_seeds();
  EXPECT_EQ(seeds.size(), 11u);
  for (const auto& seed : seeds) EXPECT_EQ(take_wire_bytes(seed), Fate::decoded) << static_cast<int>(seed[0]);
}

/// Every byte of every seed changed, one at a time, in several ways; and every length cut off.
TEST(Corpus, SeedsWithOneByteWrongDoNoMoreThanBeRejected) {
  std::set<Fate> fates;
  for (const auto& seed : wire_seeds()) {
    for (std::size_t at = 1; at < seed.size(); ++at) {
      for (const std::uint8_t change : {0x01, 0x80, 0xff}) {
        auto bytes = seed;
        bytes[at] ^= change;
        EXPECT_NO_THROW(fates.insert(take_wire_bytes(bytes)));
      }
      EXPECT_NO_THROW(take_wire_bytes(std::span(seed).first(at)));
    }
  }
  EXPECT_EQ(fates.size(), 3u);
}

}  // namespace
}  // namespace consort::fuzz
