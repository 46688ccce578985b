#include "core/option_text.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace consort {
namespace {

TEST(OptionText, WholeNumbersAreDecimalAndWithinTheirRange) {
  const auto read = [](const std::string& text) {
    return whole_option<std::uint64_t>("--seed", text, 0, std::numeric_limits<std::uint64_t>::max());
  };
  EXPECT_EQ(read("010"), 10u);
  EXPECT_EQ(read("+7"), 7u);
  EXPECT_EQ(read("18446744073709551615"), 18446744073709551615u);
  for (const char* text :
       {"-1", "-0x1", "18446744073709551616", "7x", " 7", "7 ", "0x10", "1e3", "1.0", "nan", "inf", "", "+", "+-1", "--1", "1'000"})
    EXPECT_THROW(read(text), ConfigError) << text;
  EXPECT_THROW(whole_option<std::uint32_t>("--domain", "231", 0, 230), ConfigError);
  EXPECT_THROW(whole_option<std::uint32_t>("--port", "4294967297", 1, 65000), ConfigError) << "no wrapping";
}

TEST(OptionText, NumbersAreFiniteAndWithinTheirRange) {
  EXPECT_EQ(number_option("--loss", "2.5e-1", 0.0, 0.9), 0.25);
  for (const char* text : {"-0.1", "1", "nan", "-nan", "inf", "1e999", "0.1x", "0x1p-2", "", "0,1"})
    EXPECT_THROW(number_option("--loss", text, 0.0, 0.9), ConfigError) << text;
}

TEST(NumberText, IsTheShortestThatIsReadAsTheSameNumber) {
  EXPECT_EQ(number_text(-1e-9), "-1e-09");
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(1e6), "1e+06");
  EXPECT_EQ(number_text(12.0), "12");
  EXPECT_EQ(number_text(std::numeric_limits<double>::infinity()), "inf");
  for (const double value : {1.0 / 3.0, 6.02214076e23, -5e-324}) EXPECT_EQ(parse_number<double>(number_text(value)), value);
}

}  // namespace
}  // namespace consort
