#include "core/id_list.hpp"

#include "core/errors.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

using Ids = std::vector<std::uint32_t>;

std::string mistake(const std::string& text, std::uint32_t least = 1) {
  try {
    parse_ids("--ids", text, least);
  } catch (const ConfigError& failure) {
    return failure.what();
  }
  return "";
}

TEST(IdList, MixesIdsAndRangesInWhateverOrder) {
  EXPECT_EQ(parse_ids("--ids", "7"), Ids{7});
  EXPECT_EQ(parse_ids("--ids", "1-4"), (Ids{1, 2, 3, 4}));
  EXPECT_EQ(parse_ids("--external", "0,11-13,3,12", 0), (Ids{0, 3, 11, 12, 13}));
  EXPECT_EQ(parse_ids("--ids", "1-100000").size(), 100'000u);
}

TEST(IdList, IsWrittenAsShortAsItCanBeAndReadBack) {
  for (const char* text : {"7", "1-25", "0,3,11-40", "1-2,4-5,9"}) EXPECT_EQ(to_text(parse_ids("--ids", text, 0)), text);
  EXPECT_EQ(to_text(Ids{}), "");
}

TEST(IdList, SaysWhatItFoundAndWhatIsAllowed) {
  for (const char* text : {"0", "x", "3-1", "1,,2", "1-", "", "1 2", "-3", "4294967297", "1-100001", "99999999999999999999", "1,"}) {
    SCOPED_TRACE(text);
    EXPECT_EQ(mistake(text).rfind("--ids ", 0), 0u) << mistake(text);
    EXPECT_NE(mistake(text).find("allowed: "), std::string::npos) << mistake(text);
  }
  EXPECT_EQ(mistake("0-3", 0), "");
}

}  // namespace
}  // namespace consort
