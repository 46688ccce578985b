#include "core/rows.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

/// Counts what it is given, and what rests; holds so many blocks.
struct Closet : Shelf {
  struct Kept : Block {
    explicit Kept(std::span<const std::byte> block, std::size_t& rested) : content(block.begin(), block.end()), rests(rested) {}
    [[nodiscard]] std::span<const std::byte> bytes() const override { return content; }
    void rest() const override { ++rests; }
    std::vector<std::byte> content;
    std::size_t& rests;
  };
  explicit Closet(std::size_t blocks) : room(blocks) {}
  std::shared_ptr<const Block> put(std::span<const std::byte> block) override {
    if (kept == room) return nullptr;
    ++kept;
    return std::make_shared<Kept>(block, rested);
  }
  std::size_t room, kept = 0, rested = 0;
};

constexpr std::size_t kRows = 10'000, kWidth = 101;  // about eight blocks

std::vector<double> row_of(std::size_t number) {
  std::vector<double> row(kWidth);
  for (std::size_t i = 0; i < kWidth; ++i) row[i] = static_cast<double>(number) + 1e-3 * static_cast<double>(i);
  return row;
}

Rows<double> filled(Shelf* shelf) {
  Rows<double> rows;
  for (std::size_t number = 0; number < kRows; ++number) rows.add(row_of(number), shelf);
  return rows;
}

TEST(Rows, ReadTheSameWhereverTheyLie) {
  Closet large(100), small(2);
  for (Shelf* shelf : {static_cast<Shelf*>(nullptr), static_cast<Shelf*>(&large), static_cast<Shelf*>(&small)}) {
    const Rows<double> rows = filled(shelf);
    ASSERT_EQ(rows.size(), kRows);
    for (std::size_t number = 0; number < kRows; ++number) ASSERT_TRUE(std::ranges::equal(rows[number], row_of(number))) << number;
    EXPECT_TRUE(rows == filled(nullptr));
  }
  EXPECT_EQ(large.kept, 7u) << "of 1297 rows each; the newest rows are in memory";
  EXPECT_EQ(small.kept, 2u) << "what does not fit stays in memory";
}

TEST(Rows, BlocksThatAreNotReadAnyMoreRest) {
  Closet closet(100);
  const Rows<double> rows = filled(&closet);
  for (std::size_t number = 0; number < kRows; ++number) (void)rows[number];
  EXPECT_EQ(closet.rested, 4u) << "all but the three that were read last";
  for (std::size_t turn = 0; turn < 100; ++turn)
    for (const std::size_t number : {std::size_t{0}, kRows / 2, kRows - 1}) (void)rows[number];
  EXPECT_LE(closet.rested, 6u) << "who goes to and fro does not wake them again and again";
}

TEST(Rows, OfNoNumbersAreCountedAndOthersHaveOneLength) {
  Rows<double> none;
  for (int k = 0; k < 5; ++k) none.add({});
  EXPECT_EQ(none.size(), 5u);
  EXPECT_TRUE(none[4].empty());
  Rows<int> rows;
  rows.add(std::array{1, 2});
  EXPECT_THROW(rows.add(std::array{1}), ContractViolation);
}

}  // namespace
}  // namespace consort
