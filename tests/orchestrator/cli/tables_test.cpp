#include "orchestrator/cli/tables.hpp"

#include "orchestrator/script/script.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

namespace consort {
namespace {

std::string text_in(const std::string& file) {
  std::ifstream in(std::filesystem::path(kSourceDir) / file);
  EXPECT_TRUE(in) << file;
  return {std::istreambuf_iterator<char>(in), {}};
}

class Tables : public testing::TestWithParam<std::pair<const char*, const char*>> {};

TEST_P(Tables, StandInTheGuideAsTheyAreListed) {
  const auto [what, page] = GetParam();
  const std::string begin = std::string("<!-- consort list ") + what + " --markdown -->\n", text = text_in(page);
  const std::size_t at = text.find(begin);
  ASSERT_NE(at, std::string::npos) << page << " has no line " << begin;
  const std::size_t from = at + begin.size(), to = text.find("<!-- end -->\n", from);
  ASSERT_NE(to, std::string::npos) << page;
  EXPECT_TRUE(text.substr(from, to - from) == "\n" + markdown_of(what) + "\n")
      << page << " says something else of " << what << " than their tables do: `make tables` renews it";
}

INSTANTIATE_TEST_SUITE_P(Guide, Tables,
                         testing::Values(std::pair("protocols", "docs/guide/protocols.md"),
                                         std::pair("plants", "docs/guide/experiment-file.md"),
                                         std::pair("metrics", "docs/guide/results.md")));

TEST(SchemaTables, StandInTheSchemaAsTheyAreListed) {
  EXPECT_NE(std::string(experiment_schema()).find(schema_of_tables()), std::string::npos)
      << "experiments/experiment.schema.json says something else of protocols and plants than their tables do: `make tables` renews it";
}

}  // namespace
}  // namespace consort
