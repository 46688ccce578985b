/// Whatever value of an experiment file is wrong, the user is told in which line.

#include "core/errors.hpp"
#include "core/random.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/support/tree.hpp"

#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <random>
#include <regex>
#include <sstream>

namespace consort {
namespace {

struct Scalar {
  std::size_t line, column, length;
};

/// The plain scalars of a document that are values.
void collect(const YAML::Node& node, std::vector<Scalar>& out) {
  if (node.IsScalar() && node.Tag() == "?")
    out.push_back({static_cast<std::size_t>(node.Mark().line), static_cast<std::size_t>(node.Mark().column), node.Scalar().size()});
  if (node.IsSequence())
    for (const auto& entry : node) collect(entry, out);
  if (node.IsMap())
    for (const auto& entry : node) collect(entry.second, out);
}

struct Mutant {
  std::filesystem::path file;
  std::string text, what;
};

/// Every scalar of every shipped experiment, replaced by what it hardly can be.
std::vector<Mutant> mutants() {
  constexpr std::array kWrong{"1e300", "-1", "0", "word", "[]", "{}", "1e-300", "100000", "[[1, 2], [3, 4]]", "~"};
  std::vector<Mutant> out;
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(kSourceDir) / "experiments"))
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  for (const auto& file : files) {
    std::ifstream in(file);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    std::vector<std::size_t> begins{0};
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos;) begins.push_back(++at);
    std::vector<Scalar> scalars;
    collect(YAML::Load(text), scalars);
    for (const Scalar& scalar : scalars)
      for (const char* wrong : kWrong)
        out.push_back({file, std::string(text).replace(begins[scalar.line] + scalar.column, scalar.length, wrong),
                       file.filename().string() + ":" + std::to_string(scalar.line + 1) + ": " + wrong});
  }
  return out;
}

TEST(Places, NoWrongValueOfAShippedExperimentIsRefusedWithoutItsLine) {
  constexpr std::size_t kSample = 150;
  auto all = mutants();
  std::shuffle(all.begin(), all.end(), std::minstd_rand(7));
  std::size_t refused = 0;
  for (const Mutant& mutant : std::span(all).first(kSample)) {
    SCOPED_TRACE(mutant.what);
    try {
      parse_experiment(mutant.text, "e.yaml", mutant.file.parent_path());
    } catch (const ConfigError& error) {
      ++refused;
      std::istringstream lines(error.what());
      for (std::string line; std::getline(lines, line);)
        EXPECT_TRUE(std::regex_search(line, std::regex("^(e\\.yaml:[0-9]+:[0-9]+: ..|\\.\\.\\. and [0-9]+ more$)"))) << line;
    } catch (const std::exception& error) {
      ADD_FAILURE() << error.what();
    }
  }
  EXPECT_GT(refused, kSample / 3);
}

}  // namespace
}  // namespace consort
