#include "orchestrator/script/script.hpp"
#include "protocols/registry.hpp"
#include "rounds/simulate.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace consort {
namespace {

TEST(Defaults, AreInADocumentWhatTheProtocolUses) {
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments")) {
    if (file.path().extension() != ".yaml") continue;
    SCOPED_TRACE(file.path().filename().string());
    Experiment e = load_experiment(file.path());
    e.rounds = std::min<Round>(e.rounds, 4);
    for (const ProtocolChoice& choice : e.protocols) {
      SCOPED_TRACE(choice.name);
      ProtocolChoice told = choice;
      told.parameters = with_defaults(choice.parameters, find_protocol(choice.name).parameters);
      EXPECT_EQ(simulate(e, told, e.seed).hash, simulate(e, choice, e.seed).hash);
    }
  }
}

TEST(Defaults, AreTakenFromDocumentsThatStateANumberOrAWord) {
  constexpr std::array docs{ValueDoc{"a", "scalar", "0.5", ""}, ValueDoc{"b", "one of x, y", "y", ""}, ValueDoc{"c", "scalar", "", ""},
                            ValueDoc{"d", "scalar", "10 (x), 50 (y)", ""}};
  Values given;
  given.set("c", 3.0);
  const Values all = with_defaults(given, docs);
  EXPECT_EQ(all.scalar("a"), 0.5);
  EXPECT_EQ(all.scalar("b"), 1.0);
  EXPECT_EQ(all.scalar("c"), 3.0);
  EXPECT_FALSE(all.has("d"));
}

}  // namespace
}  // namespace consort
