/// The architecture and the house rules, held by reading the project's own text. Each rule is a function of one file (or of all), so that
/// every test also shows the rule a planted fault: a rule that cannot find one fails its own test.

#include "models/registry.hpp"
#include "protocols/metrics.hpp"
#include "protocols/registry.hpp"
#include "tests/support/tree.hpp"
#include "tests/tidy/source_tree.hpp"

#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <regex>
#include <set>

namespace consort::tidy {
namespace {

using Findings = std::vector<std::string>;
using Rule = std::function<Findings(const SourceFile&)>;

const std::vector<SourceFile>& tree() {
  static const std::vector<SourceFile> files = source_tree(kSourceDir);
  return files;
}

std::string joined(const Findings& findings) {
  std::string text;
  for (const std::string& finding : findings) text += "\n  " + finding;
  return text;
}

std::string place(const SourceFile& file, std::size_t line) { return file.path + ":" + std::to_string(line) + ": "; }

/// Nothing in the project breaks the rule, and the rule does see each planted fault.
void expect_held(const Rule& rule, const std::vector<SourceFile>& planted) {
  for (const SourceFile& file : planted) EXPECT_FALSE(rule(file).empty()) << "the rule does not see the fault planted in " << file.path;
  Findings findings;
  for (const SourceFile& file : tree())
    for (std::string& finding : rule(file)) findings.push_back(std::move(finding));
  EXPECT_TRUE(findings.empty()) << joined(findings);
}

/// Every match of `pattern` in the code (not comments, not strings) of the files that `where` selects.
Rule never(const std::string& pattern, std::function<bool(const SourceFile&)> where) {
  return [expression = std::regex(pattern), where = std::move(where)](const SourceFile& file) {
    Findings findings;
    if (!file.cpp() || !where(file)) return findings;
    const std::vector<std::string> lines = lines_of(code_of(file.text));
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (std::smatch match; std::regex_search(lines[i], match, expression)) findings.push_back(place(file, i + 1) + match.str());
    return findings;
  };
}

// --- rooms and arrows ---------------------------------------------------------------------------------------------------

/// The first folder, and in the orchestrator the second too.
std::string room_of(std::string_view path) {
  const std::size_t first = path.find('/');
  if (!path.starts_with("orchestrator/")) return std::string(path.substr(0, first));
  return std::string(path.substr(0, path.find('/', first + 1)));
}

/// Room -> rooms it may include, itself among them.
const std::map<std::string, std::set<std::string>>& arrows() {
  static const auto table = [] {
    std::map<std::string, std::set<std::string>> rooms{
        {"dds", {}},
        {"core", {}},
        {"models", {"core"}},
        {"protocols", {"models", "core"}},
        {"rounds", {"models", "protocols", "core"}},
        {"io", {"core"}},
        {"idl", {"io", "core", "dds"}},
        {"process", {"idl", "io", "core", "dds"}},
        {"agent", {"process", "rounds", "protocols", "idl", "dds", "core"}},
        {"plant", {"process", "models", "idl", "dds", "core"}},
        {"orchestrator/script", {"rounds", "models", "protocols", "core"}},
        {"orchestrator/run", {"orchestrator/script", "rounds", "models", "protocols", "process", "idl", "dds", "io", "core"}},
        {"orchestrator/report", {"orchestrator/run", "orchestrator/script", "rounds", "models", "protocols", "io", "core"}},
        {"orchestrator/cli",
         {"orchestrator/report", "orchestrator/run", "orchestrator/script", "rounds", "models", "protocols", "process", "idl", "dds", "io",
          "core"}},
    };
    for (auto& [room, allowed] : rooms) allowed.insert(room);
    return rooms;
  }();
  return table;
}

/// The room an include leads to; empty for the standard library and other people's libraries.
std::string room_included(const std::string& what) {
  if (what.starts_with("dds/")) return what == "dds/dds.h" ? "libddsc" : "dds";
  if (what == "consort.h") return "generated";
  const std::string room = room_of(what);
  return arrows().contains(room) || room == "tests" ? room : "";
}

Findings forbidden_includes(const SourceFile& file) {
  Findings findings;
  const auto allowed = arrows().find(room_of(file.path));
  if (!file.cpp() || allowed == arrows().end()) return findings;
  for (const SourceFile::Include& include : file.includes()) {
    const std::string room = room_included(include.what);
    const bool driver = room == "libddsc" || room == "generated";
    if (room.empty() || (driver ? starts_with_any(file.path, {"dds/", "idl/"}) : allowed->second.contains(room))) continue;
    findings.push_back(place(file, include.line) + allowed->first + " may not include " + include.what);
  }
  return findings;
}

TEST(Architecture, RoomsIncludeOnlyWhatTheArrowsAllow) {
  expect_held(forbidden_includes, {{"core/network/graph.cpp", "#include \"idl/wire.hpp\"\n"},
                                   {"rounds/simulate.cpp", "#include \"orchestrator/run/run.hpp\"\n"}});
}

/// Which room is seen to include which: pairs of rooms, without what one gets through another.
std::set<std::pair<std::string, std::string>> arrows_to_draw() {
  std::map<std::string, std::set<std::string>> includes;
  for (const SourceFile& file : tree())
    if (const std::string room = room_of(file.path); file.cpp() && arrows().contains(room))
      for (const SourceFile::Include& include : file.includes())
        if (const std::string other = room_included(include.what); other != room && arrows().contains(other)) includes[room].insert(other);
  const std::function<bool(const std::string&, const std::string&)> leads = [&](const std::string& from, const std::string& to) {
    const auto& next = includes[from];
    return next.contains(to) || std::any_of(next.begin(), next.end(), [&](const std::string& room) { return leads(room, to); });
  };
  std::set<std::pair<std::string, std::string>> found;
  for (const auto& [room, others] : std::map(includes))
    for (const std::string& other : others)
      if (std::none_of(others.begin(), others.end(), [&](const std::string& way) { return leads(way, other); })) found.emplace(room, other);
  return found;
}

TEST(Architecture, ThePictureOfTheRoomsShowsWhatTheyInclude) {
  static const std::regex arrow("<title>([^<]+)&#45;&gt;([^<]+)</title>");
  const std::string picture = text_in(std::filesystem::path(kSourceDir) / "docs/rooms.svg");
  std::set<std::pair<std::string, std::string>> drawn;
  for (auto it = std::sregex_iterator(picture.begin(), picture.end(), arrow); it != std::sregex_iterator(); ++it)
    drawn.emplace((*it)[1].str(), (*it)[2].str());
  EXPECT_EQ(drawn, arrows_to_draw()) << "docs/draw-rooms.sh draws it again";
}

/// The file of one algorithm, among those of its family.
bool is_protocol(const SourceFile& file) {
  return file.path.starts_with("protocols/") && file.text.find("static constexpr std::string_view name") != std::string::npos;
}

TEST(Architecture, ProtocolsNeverIncludeEachOther) {
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    if (!is_protocol(file)) return findings;
    for (const SourceFile::Include& include : file.includes())
      for (const SourceFile& other : tree())
        if (other.path == include.what && is_protocol(other)) findings.push_back(place(file, include.line) + include.what);
    return findings;
  };
  expect_held(rule, {{"protocols/consensus/planted.hpp",
                      "#include \"protocols/consensus/local_voting.hpp\"\n  static constexpr std::string_view name = \"planted\";\n"}});
}

/// protocols/filters, of one of its files; empty for what is in no family's folder.
std::string family_of(std::string_view path) {
  const std::size_t end = path.find('/', path.find('/') + 1);
  return path.starts_with("protocols/") && end != std::string_view::npos ? std::string(path.substr(0, end)) : "";
}

TEST(Architecture, FamiliesNeverIncludeEachOther) {
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    const std::string family = family_of(file.path);
    if (family.empty() || family == "protocols/") return findings;
    for (const SourceFile::Include& include : file.includes())
      if (const std::string other = family_of(include.what); !other.empty() && other != family)
        findings.push_back(place(file, include.line) + include.what);
    return findings;
  };
  expect_held(rule, {{"protocols/filters/planted.hpp", "#include \"protocols/adaptive/gains.hpp\"\n"}});
}

/// Where each protocol and each model is at home: its name, and the folder of its file.
const std::map<std::string, std::string>& homes() {
  static const auto table = [] {
    std::map<std::string, std::string> found;
    static const std::regex named(R"re(static constexpr std::string_view name = "(\w+)";)re");
    for (const SourceFile& file : tree())
      if (std::smatch match; starts_with_any(file.path, {"protocols/", "models/"}) && std::regex_search(file.text, match, named))
        found[match[1].str()] = file.path.substr(0, file.path.rfind('/') + 1);
    return found;
  }();
  return table;
}

/// Does a string literal name it: alone, or, where the name is no word of English, within a text?
bool names(const std::string& literal, const std::string& name) {
  if (literal == '"' + name + '"') return true;
  const std::size_t at = name.find('_') == std::string::npos ? std::string::npos : literal.find(name);
  const auto in_word = [&](std::size_t place) { return std::isalnum(static_cast<unsigned char>(literal[place])) || literal[place] == '_'; };
  return at != std::string::npos && !in_word(at - 1) && !in_word(at + name.size());
}

/// Whoever asks "which protocol is this?" asks its entry.
TEST(Architecture, NamesOfProtocolsAndModelsStandInTheirFamiliesOnly) {
  ASSERT_EQ(homes().size(), protocol_table().size() + plant_table().size());
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    if (!file.cpp() || file.test()) return findings;
    std::vector<std::pair<std::size_t, std::string>> literals;
    code_of(file.text, &literals);
    for (const auto& [at, literal] : literals) {
      const auto line = static_cast<std::size_t>(std::count(file.text.begin(), file.text.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
      if (lines_of(file.text)[line].starts_with("#include")) continue;
      for (const auto& [name, home] : homes())
        if (!file.path.starts_with(home) && names(literal, name)) findings.push_back(place(file, line + 1) + literal);
    }
    return findings;
  };
  expect_held(rule, {{"orchestrator/planted.cpp", "if (choice.name == \"local_voting\") return;\n"},
                     {"protocols/filters/planted.cpp", "throw ConfigError(\"take the model shared_linear\");\n"},
                     {"core/planted.cpp", "bool is(auto model) { return model == \"linear\"; }\n"}});
}

TEST(Architecture, OnlyDriversLog) {
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    const std::string name = file.name();
    const bool driver = starts_with_any(name, {"node", "run", "launch", "session", "main"}) &&
                        starts_with_any(file.path, {"agent/", "plant/", "process/", "orchestrator/"});
    for (const SourceFile::Include& include : file.includes())
      if (include.what.starts_with("spdlog/") && !driver && !file.test()) findings.push_back(place(file, include.line) + include.what);
    return findings;
  };
  expect_held(rule, {{"core/network/graph.cpp", "#include <spdlog/spdlog.h>\n"}});
}

bool pure(const SourceFile& file) {
  const std::string room = room_of(file.path);
  return room == "core" || room == "protocols" || room == "models" || room == "rounds";
}

TEST(Architecture, PureRoomsHaveNoClockFileThreadOrHashOrder) {
  expect_held(never(R"(\b(system_clock|steady_clock|high_resolution_clock|time\s*\(|gettimeofday|getenv|unordered_(map|set)))", pure),
              {{"core/planted.cpp", "auto now = std::chrono::system_clock::now();\n"}});
  expect_held(never(R"(^\s*#\s*include\s*<(iostream|fstream|filesystem|thread|chrono|random|ctime|cstdio|unistd\.h|sys/[a-z]+\.h)>)", pure),
              {{"protocols/consensus/planted.hpp", "#include <thread>\n"}});
}

TEST(Architecture, ProductCodeNeverUsesUnkeyedRandomnessOrSleeps) {
  const auto everywhere = [](const SourceFile&) { return true; };
  expect_held(
      never(R"(\b(s?rand|drand48)\s*\(|\brandom_device\b|\bnormal_distribution\b|\bmt19937|::Random\s*\(|\bsetRandom\b)", everywhere),
      {{"orchestrator/planted.cpp", "int x = rand();\n"}});
  expect_held(never(R"(\b(sleep_for|sleep_until|usleep|nanosleep|dds_sleepfor)\b|\bsleep\s*\()", everywhere),
              {{"tests/planted.cpp", "std::this_thread::sleep_for(1s);\n"}});
}

// --- style that tools do not hold ---------------------------------------------------------------------------------------

TEST(Style, EveryHeaderHasPragmaOnce) {
  const Rule rule = [](const SourceFile& file) {
    return file.header() && !file.text.starts_with("#pragma once\n") ? Findings{place(file, 1) + "does not begin with #pragma once"}
                                                                     : Findings{};
  };
  expect_held(rule, {{"core/planted.hpp", "struct Planted {};\n"}});
}

TEST(Style, LinesHaveNoTabsTrailingSpaceOrExcessLength) {
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    const std::vector<std::string> lines = lines_of(file.text);
    const bool short_lines = file.cpp() || ends_with_any(file.path, {".idl", ".yaml", ".sh", ".md", "CMakeLists.txt"});
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const std::string& line = lines[i];
      if (line.find('\t') != std::string::npos && file.name() != "Makefile") findings.push_back(place(file, i + 1) + "tab");
      if (ends_with_any(line, {" ", "\r"})) findings.push_back(place(file, i + 1) + "trailing space");
      if (short_lines && characters(line) > 140) findings.push_back(place(file, i + 1) + std::to_string(characters(line)) + " characters");
    }
    if (!file.text.ends_with('\n')) findings.push_back(place(file, lines.size()) + "no line break at the end");
    return findings;
  };
  expect_held(rule, {{"core/planted.hpp", "int a;\t// tab\n"},
                     {"docs/planted.md", "trailing \n"},
                     {"core/planted.cpp", std::string(141, 'x') + "\n"},
                     {"docs/planted.md", std::string(141, 'x') + "\n"},
                     {"core/planted.cpp", "int a;"}});
}

/// Files of the product that may be longer than others, and why.
const std::map<std::string, std::string>& long_files() {
  static const std::map<std::string, std::string> reasons{
      {"core/network/schedule.cpp", "three kinds of schedule behind one contract, each short"},
      {"dds/include/dds/core.hpp", "the binding keeps the partition of the ISO/IEC C++ API"},
      {"dds/include/dds/sub.hpp", "the binding keeps the partition of the ISO/IEC C++ API"},
      {"idl/codec.cpp", "every type of the wire, out and in, one below the other"},
      {"idl/wire.cpp", "every topic's reader and writer, one below the other"},
      {"orchestrator/cli/doctor.cpp", "a list of checks, each a few lines"},
      {"orchestrator/cli/run.cpp", "the options of the largest verb, and what it does with them in order"},
      {"orchestrator/report/table.cpp", "the rows of one table"},
      {"orchestrator/script/resolved.cpp", "the whole file written back, section after section"},
  };
  return reasons;
}

/// A reason that is needed no longer goes.
TEST(Style, LongFilesHaveAReason) {
  constexpr std::size_t kLong = 300;
  const Rule rule = [](const SourceFile& file) {
    const std::size_t lines = lines_of(file.text).size();
    if (!file.cpp() || file.test() || (lines > kLong) == long_files().contains(file.path)) return Findings{};
    return Findings{file.path + ": " + std::to_string(lines) + (lines > kLong ? " lines without a reason" : " lines need no reason")};
  };
  std::string text;
  for (std::size_t line = 0; line <= kLong; ++line) text += "int a;\n";
  expect_held(rule, {{"core/planted.cpp", text}, {long_files().begin()->first, "int a;\n"}});
}

TEST(Style, NothingIsLeftUnfinished) {
  const Rule rule = [](const SourceFile& file) {
    static const std::regex unfinished(R"(\b(TODO|FIXME|XXX|HACK|DISABLED_\w+|GTEST_SKIP)\b)");
    Findings findings;
    if (file.path.starts_with("tests/tidy/")) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
      if (std::regex_search(lines[i], unfinished)) findings.push_back(place(file, i + 1) + lines[i]);
    return findings;
  };
  expect_held(rule, {{"core/planted.cpp", "// TODO later\n"}});
}

TEST(Style, TypesAreNamedForWhatTheyAre) {
  const auto product = [](const SourceFile& file) { return !file.test(); };
  expect_held(never(R"(\b(class|struct)\s+\w*(Manager|Handler|Helper|Utils?|Ticker|Peer)\b)", product),
              {{"core/planted.hpp", "class LinkManager;\n"}});
}

// --- what readers are promised ------------------------------------------------------------------------------------------

TEST(Documentation, EveryExperimentOpensWithItsQuestion) {
  const Rule rule = [](const SourceFile& file) {
    const bool experiment = file.path.starts_with("experiments/") && file.path.ends_with(".yaml");
    return experiment && !file.text.starts_with("# ") ? Findings{place(file, 1) + "no header comment"} : Findings{};
  };
  expect_held(rule, {{"experiments/planted.yaml", "experiment: planted\n"}});
}

TEST(Documentation, EveryProtocolFileNamesSourceAssumptionsAndLoss) {
  const Rule rule = [](const SourceFile& file) {
    Findings findings;
    if (!is_protocol(file)) return findings;
    const std::string opening = file.text.substr(0, file.text.find("\nnamespace"));
    for (const char* wanted : {"/// Source: ", "/// Assumes: ", "missing message"})
      if (opening.find(wanted) == std::string::npos) findings.push_back(place(file, 1) + "the opening comment has no '" + wanted + "'");
    return findings;
  };
  expect_held(rule, {{"protocols/consensus/planted.hpp",
                      "#pragma once\n/// An algorithm.\nnamespace consort { static constexpr std::string_view name = \"planted\"; }\n"}});
}

const std::string& page(std::string_view path) {
  return std::find_if(tree().begin(), tree().end(), [&](const SourceFile& file) { return file.path == path; })->text;
}

void expect_named(const auto& table, std::string_view where) {
  ASSERT_FALSE(table.empty());
  for (const auto& entry : table)
    EXPECT_NE(page(where).find("`" + std::string(entry.name) + "`"), std::string::npos) << where << " does not name " << entry.name;
}

TEST(Documentation, ReadmeIsOnePage) {
  const std::vector<std::string> lines = lines_of(page("README.md"));
  EXPECT_LE(lines.size(), 120U);
  for (const std::string& line : lines) EXPECT_LE(characters(line), 120U) << line;
}

TEST(Documentation, GuideNamesEveryShippedExperiment) {
  std::size_t experiments = 0;
  for (const SourceFile& file : tree()) {
    if (!file.path.starts_with("experiments/") || !file.path.ends_with(".yaml")) continue;
    ++experiments;
    EXPECT_NE(page("docs/guide/experiments.md").find("`" + file.name() + "`"), std::string::npos) << file.path;
  }
  EXPECT_GE(experiments, 13U);
}

/// What stands in backticks and looks like a file or a function of the project. The worked example is in CONTRIBUTING.md alone, and pages
/// of history may name what is gone.
TEST(Documentation, FilesAndFunctionsThatAreNamedExist) {
  const Rule rule = [](const SourceFile& file) {
    static const std::regex named(
        R"(`((?:(?:agent|cmake|core|dds|deploy|docs|experiments|idl|io|models|orchestrator|plant|process|protocols|rounds|tests)/)"
        R"([\w./@-]+\.[a-z]+)|)"
        R"((?:\w+::)?(\w+)\(\))`)");
    Findings findings;
    if (!file.path.ends_with(".md") || starts_with_any(file.path, {"docs/decisions/", "CHANGELOG"})) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
      for (auto it = std::sregex_iterator(lines[i].begin(), lines[i].end(), named); it != std::sregex_iterator(); ++it) {
        const std::string path = (*it)[1].str(), function = (*it)[2].str();
        if (path.find("max_consensus") != std::string::npos) continue;
        const auto calls = [&](const SourceFile& other) { return other.cpp() && other.text.find(function + "(") != std::string::npos; };
        const bool there = function.empty() ? std::filesystem::exists(std::filesystem::path(kSourceDir) / path)
                                            : std::any_of(tree().begin(), tree().end(), calls);
        if (!there) findings.push_back(place(file, i + 1) + path);
      }
    return findings;
  };
  expect_held(rule, {{"docs/planted.md", "See `agent/nowhere.hpp`.\n"},
                     {"docs/planted.md",
                      "It calls `Node::no_such_"
                      "function()`.\n"}});
}

TEST(Documentation, GuideNamesEveryProtocolPlantAndMetric) {
  EXPECT_NE(page("README.md").find("[" + std::to_string(protocol_table().size()) + " protocols]"), std::string::npos);
  expect_named(protocol_table(), "docs/guide/protocols.md");
  expect_named(plant_table(), "docs/guide/experiment-file.md");
  expect_named(metric_table(), "docs/guide/results.md");
}

std::vector<std::string> headings(const std::string& text) {
  std::vector<std::string> found;
  bool code = false;
  for (const std::string& line : lines_of(text)) {
    if (line.starts_with("```")) code = !code;
    if (!code && line.starts_with("#")) found.push_back(line);
  }
  return found;
}

/// The anchors of a page, as its headings make them: lower case, spaces as hyphens, nothing else but letters, digits and hyphens.
std::set<std::string> anchors(const std::string& text) {
  std::set<std::string> found;
  for (const std::string& heading : headings(text)) {
    std::string anchor;
    for (const char c : heading.substr(heading.find_first_not_of("# ")))
      if (c == ' ' || c == '-')
        anchor += '-';
      else if (c == '_' || std::isalnum(static_cast<unsigned char>(c)) != 0)
        anchor += static_cast<char>(std::tolower(c));
    found.insert(anchor);
  }
  return found;
}

TEST(Documentation, LinksInMarkdownLeadSomewhere) {
  const Rule rule = [](const SourceFile& file) {
    static const std::regex link(R"(\]\(([^)#:]*)(#([^)]*))?\))");
    Findings findings;
    if (!file.path.ends_with(".md")) return findings;
    const auto folder = (std::filesystem::path(kSourceDir) / file.path).parent_path();
    for (auto it = std::sregex_iterator(file.text.begin(), file.text.end(), link); it != std::sregex_iterator(); ++it) {
      const std::string where = (*it)[1].str(), anchor = (*it)[3].str();
      const bool there = where.empty() || std::filesystem::exists(folder / where);
      if (!there || (!anchor.empty() && !anchors(where.empty() ? file.text : text_in(folder / where)).contains(anchor)))
        findings.push_back(file.path + ": " + it->str());
    }
    return findings;
  };
  expect_held(rule, {{"docs/planted.md", "[here](nowhere.md)\n"},
                     {"docs/planted.md", "# There\n[here](#their)\n"},
                     {"docs/planted.md", "[here](architecture.md#nowhere)\n"}});
}

TEST(Documentation, MakeTargetsThatAreNamedExist) {
  const Rule rule = [](const SourceFile& file) {
    static const std::regex typed(R"(^make (?:[A-Z]+=\S+ )*([a-z-]+))"), quoted(R"(`make (?:[A-Z]+=\S+ )*([a-z-]+))");
    Findings findings;
    bool code = false;
    if (!file.path.ends_with(".md")) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      if (lines[i].starts_with("```")) code = !code;
      for (auto it = std::sregex_iterator(lines[i].begin(), lines[i].end(), code ? typed : quoted); it != std::sregex_iterator(); ++it)
        if (("\n" + page("Makefile")).find("\n" + (*it)[1].str() + ":") == std::string::npos)
          findings.push_back(place(file, i + 1) + it->str());
    }
    return findings;
  };
  expect_held(rule, {{"docs/planted.md", "```sh\nmake dinner\n```\n"}, {"docs/planted.md", "Say `make PRESET=asan dinner`.\n"}});
}

TEST(Documentation, DecisionsAreNumberedWithoutGaps) {
  std::size_t next = 0;
  for (const SourceFile& file : tree()) {  // ascending by path
    if (!file.path.starts_with("docs/decisions/")) continue;
    ++next;
    const std::string digits = std::to_string(next);
    EXPECT_TRUE(file.name().starts_with(std::string(4 - digits.size(), '0') + digits + "-")) << file.path << ": expected number " << next;
    EXPECT_TRUE(file.text.starts_with("# " + digits + ". ")) << file.path << ": the title should begin '# " << digits << ". '";
  }
  EXPECT_GT(next, 0U);
}

TEST(Documentation, DecisionsHaveContextDecisionAndConsequence) {
  const Rule rule = [](const SourceFile& file) {
    if (!file.path.starts_with("docs/decisions/")) return Findings{};
    std::vector<std::string> parts = headings(file.text);
    if (!parts.empty()) parts.erase(parts.begin());
    return parts == std::vector<std::string>{"## Context", "## Decision", "## Consequence"}
               ? Findings{}
               : Findings{place(file, 1) + "the headings below its title should be Context, Decision and Consequence"};
  };
  expect_held(rule, {{"docs/decisions/0001-planted.md", "# 1. Planted\n\n## Decision\n\nIt is.\n"}});
}

TEST(Documentation, ChangesAreAddedChangedOrFixedInAVersion) {
  const std::vector<std::string> found = headings(page("CHANGELOG.md"));
  ASSERT_GE(found.size(), 2U);
  EXPECT_EQ(found[1], "## Unreleased");
  static const std::regex form(R"(# Changelog|## (Unreleased|\d+\.\d+\.\d+)|### (Added|Changed|Fixed))");
  for (const std::string& heading : found) EXPECT_TRUE(std::regex_match(heading, form)) << heading;
}

TEST(Documentation, TheVersionIsTheSameEverywhere) {
  const auto version_in = [](const std::string& text, const char* form) {
    std::smatch match;
    return std::regex_search(text, match, std::regex(form)) ? match[1].str() : "none in " + text.substr(0, 40);
  };
  const std::string version = version_in(page("CMakeLists.txt"), R"(project\(consort VERSION (\S+))");
  EXPECT_EQ(version_in(page("CHANGELOG.md"), R"(\n## (\d\S*))"), version);
  EXPECT_EQ(version_in(text_in(std::filesystem::path(kSourceDir) / "CITATION.cff"), R"(\nversion: (\S+))"), version);
  EXPECT_EQ(version_in(text_in(std::filesystem::path(kSourceDir) / "python/pyproject.toml"), R"=(\nversion = "(\S+)")="), version);
}

TEST(Tidy, BlanksCommentsAndLiteralsOnly) {
  EXPECT_EQ(code_of("a(); // rand()\nb(\"rand()\");"), "a();          \nb(        );");
  EXPECT_EQ(code_of("/* x\ny */ c;"), "    \n     c;");
  EXPECT_EQ(code_of("int n = 1'000; char q = '\"'; d();"), "int n = 1'000; char q =    ; d();");
  EXPECT_EQ(code_of("auto s = R\"(\")\"; e();"), "auto s =       ; e();");
}

}  // namespace
}  // namespace consort::tidy
