#include "idl/card.hpp"

#include <gtest/gtest.h>

namespace consort::wire {
namespace {

std::optional<Card> read(const std::string& text) { return Card::of(std::vector<unsigned char>(text.begin(), text.end())); }

TEST(Card, IsReadBackAsItWasWritten) {
  const Card card{"consort-agent", {"1.2.3", "00ff00ff", "0.10.2", "0123456789ab-dirty"}, "1-3,7"};
  const auto again = Card::of(card.bytes());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->role, "consort-agent");
  EXPECT_EQ(again->build, card.build);
  EXPECT_EQ(again->ids, "1-3,7");
}

TEST(Card, OfABuildThatSaysMoreOrLessIsReadAsFarAsItIsKnown) {
  const auto newer = read("consort card\nrole=consort\nwire=2\ncolour=red\nnonsense\nprogram=9.0\n");
  ASSERT_TRUE(newer);
  EXPECT_EQ(newer->build, (Build{"9.0", "2", ""}));
  EXPECT_FALSE(newer->build.fits(Build::own()));
}

TEST(Card, OfAnybodyElseIsNone) {
  EXPECT_FALSE(read(""));
  EXPECT_FALSE(read("role=consort\n"));
  EXPECT_FALSE(read(std::string("\0\1\2consort card", 15)));
}

TEST(Card, CannotWriteOnAPersonsTerminal) {
  const auto card = read("consort card\nrole=\033[2Jcleared\nids=" + std::string(5000, '1') + "\n");
  ASSERT_TRUE(card);
  EXPECT_EQ(card->role, "?[2Jcleared");
  EXPECT_LE(card->ids.size(), 200u);
}

TEST(Build, FitsTheSameProgramAndWireWhateverThePatchLevelOfCyclone) {
  const Build own = Build::own();
  EXPECT_FALSE(own.program.empty());
  EXPECT_EQ(own.wire.size(), 8u) << own.wire;
  EXPECT_TRUE(own.fits(own));
  EXPECT_TRUE((Build{"1", "2", "0.10.2"}.fits({"1", "2", "0.10.5"})));
  EXPECT_FALSE((Build{"1", "2", "0.10.2"}.fits({"1", "2", "0.11.0"})));
  EXPECT_FALSE((Build{"1", "2", "0.10.2"}.fits({"1", "3", "0.10.2"})));
  EXPECT_FALSE((Build{"1", "2", "0.10.2"}.fits({"2", "2", "0.10.2"})));
  EXPECT_EQ(Build::from_word(own.word()), own);
}

TEST(Build, OfAnotherCommitFitsAndIsToldApart) {
  const Build one{"1", "2", "0.10.2", "aaaa"}, other{"1", "2", "0.10.2", "bbbb"}, silent{"1", "2", "0.10.2"};
  EXPECT_TRUE(one.fits(other));
  EXPECT_FALSE(one.same_sources(other));
  EXPECT_TRUE(one.same_sources(one));
  EXPECT_TRUE(one.same_sources(silent) && silent.same_sources(one)) << "who does not say is not accused";
}

}  // namespace
}  // namespace consort::wire
