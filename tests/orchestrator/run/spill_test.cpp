#include "orchestrator/run/spill.hpp"

#include "tests/support/program.hpp"

#include <gtest/gtest.h>

#include <fstream>

namespace consort {
namespace {

constexpr std::size_t kMiB = std::size_t{1} << 20;

std::size_t resident_bytes() {
  std::size_t size = 0, resident = 0;
  std::ifstream("/proc/self/statm") >> size >> resident;
  return resident * static_cast<std::size_t>(sysconf(_SC_PAGESIZE));
}

TEST(Spill, HoldsInAFileThatNobodySeesWhatIsThenReadAsFromMemory) {
  const Folder folder;
  const auto shelf = spill_in(folder.path());
  const std::size_t before = resident_bytes();
  Rows<std::uint64_t> rows;
  constexpr std::size_t kRows = 6000, kWidth = 1500;  // 69 MiB
  std::vector<std::uint64_t> row(kWidth);
  for (std::size_t number = 0; number < kRows; ++number) {
    row.front() = row.back() = number;
    rows.add(row, shelf.get());
  }
  for (std::size_t number = 0; number < kRows; ++number) {
    ASSERT_EQ(rows[number].front(), number);
    ASSERT_EQ(rows[number].back(), number);
  }
  EXPECT_LT(resident_bytes(), before + 16 * kMiB);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Spill, ThatCannotBeMadeIsNone) {
  EXPECT_EQ(spill_in({}), nullptr);
  const auto nowhere = spill_in("/proc");
  EXPECT_EQ(nowhere->put(std::as_bytes(std::span("a block"))), nullptr) << "then it stays in memory";
}

}  // namespace
}  // namespace consort
