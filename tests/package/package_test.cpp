/// What `make package` and `make install` hand out, as somebody uses it who has neither the sources nor this build.

#include "tests/docs/pages.hpp"
#include "tests/package/fresh_debian.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <regex>

namespace consort::package {
namespace {

const std::filesystem::path kBuild = std::filesystem::path(kBinDir).parent_path();
const char* const kPage = "docs/guide/installing.md";

class Package : public testing::Test {
 protected:
  /// A line of bash that succeeds; what it prints.
  std::string here(const std::string& line) {
    Program program(folder_, "/bin/bash", {"-ec", "cd " + folder_.path().string() + "; " + line});
    EXPECT_EQ(program.wait(), 0) << line << "\n" << program.out() << program.err();
    return program.out();
  }
  static std::string hash(const std::string& summary) {
    const auto read = nlohmann::json::parse(summary, nullptr, false);
    return read.is_object() ? read.value("trace_hash", "none") : summary;
  }
  Folder folder_;
};

/// The files of the guide's program, which stand in its page and in CONTRIBUTING.md.
std::map<std::string, std::string> guides_program() {
  std::map<std::string, std::string> files{{"max_consensus.hpp", docs::blocks_in("CONTRIBUTING.md").at(1).text}};
  for (const docs::Block& block : docs::blocks_in(kPage))
    if (block.language == "cmake" || block.language == "cpp") files[block.title] = block.text;
  return files;
}

/// What its reader, or that of another page, types with this word.
std::string typed_with(const std::string& word, const char* page = kPage) {
  for (const docs::Block& block : docs::blocks_in(page))
    if (block.language == "sh" && block.text.find(word) != std::string::npos) return block.text;
  return "false  # nothing is typed with " + word;
}

/// Names of the packages that Depends fields ask for, of several the first; but for Consort's own.
std::set<std::string> asked_for(const std::string& fields) {
  static const std::regex name("(?:^|,|\n) *([a-z0-9][a-z0-9.+-]+)");
  std::set<std::string> names;
  for (auto it = std::sregex_iterator(fields.begin(), fields.end(), name); it != std::sregex_iterator(); ++it)
    if ((*it)[1] != "consort") names.insert((*it)[1]);
  return names;
}

void expect_alike(const std::set<std::string>& before, const std::set<std::string>& after) {
  std::vector<std::string> differ;
  std::set_symmetric_difference(before.begin(), before.end(), after.begin(), after.end(), std::back_inserter(differ));
  EXPECT_TRUE(differ.empty()) << fmt::format("{}", fmt::join(differ, "\n"));
}

TEST_F(Package, ServesAStrangerInAFreshDebianAndLeavesNoTrace) {
  here("mkdir debs; cpack --config " + (kBuild / "CPackConfig.cmake").string() + " -B $PWD/made; mv made/*.deb debs; rm -r made");
  here("lintian --fail-on error debs/*.deb");
  auto needed = asked_for(here("for deb in debs/*.deb; do dpkg-deb -f $deb Depends; done"));
  needed.insert({"g++", "cmake", "make"});
  const FreshDebian debian(folder_, needed);
  ASSERT_EQ(debian.missing(), "");
  const auto in = [&debian](const std::string& user, const std::string& line) {
    const auto program = debian.run(user, line);
    EXPECT_EQ(program->wait(), 0) << line << "\n" << program->out() << program->err();
    return program->out();
  };
  const auto before = debian.files();
  std::filesystem::copy(folder_.path() / "debs", debian.root() / "tmp/debs");
  in("root", "dpkg --install /tmp/debs/*.deb");

  const std::string run = "consort run /usr/share/consort/experiments/meet_for_dinner.yaml --quiet --json --no-report ";
  const std::string simulated = hash(in("reader", run + "--mode simulate")), real = hash(in("reader", run));
  EXPECT_EQ(simulated, real);
  EXPECT_EQ(real.size(), 16U) << real;
  in("reader", "python3 -c 'import consort; assert consort.load(\"'$(ls -d results/* | head -n 1)'\").passed'");
  for (const char* file : {"/usr/share/man/man1/consort-run.1.gz", "/usr/share/zsh/vendor-completions/_consort",
                           "/usr/share/doc/consort/copyright", "/usr/share/bash-completion/completions/consort-agent"})
    EXPECT_TRUE(std::filesystem::exists(debian.root().string() + file)) << file;

  std::filesystem::create_directory(debian.root() / "tmp/largest");
  for (const auto& [name, text] : guides_program()) folder_.write("debian/tmp/largest/" + name, text);
  const std::string largest = in("reader", "cp -r /tmp/largest . && cd largest && " + typed_with("cmake -B"));
  EXPECT_TRUE(largest.ends_with("10 10 10 10 10 10 \n10 10 10 10 10 10 \n10 10 10 10 10 10 \n")) << largest;

  in("root", "dpkg --purge python3-consort libconsort-dev consort");
  expect_alike(before, debian.files());
}

/// Keeps, while it exists, what this build notes of an installation that a user has made.
class NotesOfInstallation {
 public:
  NotesOfInstallation() { move("", ".kept"); }
  ~NotesOfInstallation() { move(".kept", ""); }
  NotesOfInstallation(const NotesOfInstallation&) = delete;
  NotesOfInstallation& operator=(const NotesOfInstallation&) = delete;

 private:
  static void move(const std::string& from, const std::string& to) {
    for (const char* note : {"install_manifest.txt", "install_folders.txt"})
      if (std::filesystem::exists(kBuild / (note + from))) std::filesystem::rename(kBuild / (note + from), kBuild / (note + to));
  }
};

class Installation : public Package {
 protected:
  void SetUp() override { here("cmake --install " + kBuild.string() + " --prefix $PWD/opt/first"); }
  NotesOfInstallation notes_;
};

TEST_F(Installation, WorksElsewhereAndIsRemovedWhole) {
  here("mv opt/first moved");
  const std::string run = "moved/bin/consort run moved/share/consort/experiments/meet_for_dinner.yaml --quiet --json --no-report ";
  EXPECT_EQ(hash(here(run + "--output real")), hash(here(run + "--output same --mode simulate")));
  for (const auto& [name, text] : guides_program()) folder_.write(name, text);
  const std::string built =
      here("export PKG_CONFIG_PATH=moved/lib/pkgconfig; c++ -O0 main.cpp $(pkg-config --cflags --libs consort) && ./a.out");
  EXPECT_TRUE(built.starts_with("10 10 10 10 10 10 \n")) << built;

  here("mv moved opt/first; echo kept >opt/first/share/of_somebody; cmake -P " + (kBuild / "uninstall.cmake").string());
  EXPECT_EQ(here("find opt -mindepth 1"), "opt/first\nopt/first/share\nopt/first/share/of_somebody\n");
}

/// Numbers of one agent as `consort export --shape long` writes them, compared with the lines that listeners print.
constexpr const char* kCompare =
    "import csv\n"
    "record = {int(row['round']): float(row['value']) for row in csv.DictReader(open('straggler/csv/long.csv')) if row['agent'] == '3'}\n"
    "for name in ('cyclone.txt', 'fast.txt'):\n"
    "    lines = [line.split() for line in open(name) if line.startswith('round ')]\n"
    "    assert lines and int(lines[-1][1][:-1]) == max(record), name\n"
    "    for _, round, value in lines:\n"
    "        assert float(value) == record[int(round[:-1])], (name, round)\n";

TEST_F(Installation, OtherDdsProgramsReadARunAndDoItNoHarm) {
  const std::string domain = std::to_string(20 + getpid() % 80), prefix = "prefix=$PWD/opt/first; export PATH=$prefix/bin:$PATH; ";
  here(prefix + std::regex_replace(typed_with("listener-fastdds", "docs/guide/listening.md"), std::regex(R"(\b7\b)"), domain));
  here("opt/first/bin/consort export straggler --shape long");
  folder_.write("compare.py", kCompare);
  here("python3 compare.py");

  // Listeners that are stopped in the middle of a run; its own criteria are not asked about.
  const std::string run = prefix +
                          "consort run $prefix/share/consort/experiments/meet_for_dinner.yaml --rounds 20000 --quiet --json --no-report "
                          "$more --output $name >$name.json || [ $? = 1 ]; ";
  const std::string undisturbed = hash(here("more='--mode simulate'; name=simulated; " + run + "cat simulated.json"));
  const std::string beside =
      hash(here("cyclone/listener '' " + domain + " 3 >a & a=$!; fast/listener-fastdds " + domain +
                " 3 >b & b=$!; trap 'kill -KILL $a $b' EXIT; (name=beside; more='--open-domain --domain " + domain + "'; " + run +
                ") & r=$!; until grep -q round a && grep -q round b; do sleep 0.02; done; kill -STOP $a $b; "
                "wait $r; cat beside.json"));
  EXPECT_EQ(beside, undisturbed);
}

TEST_F(Installation, ManualPagesHaveEveryOptionAndNoMistakes) {
  static const std::regex option("--[a-z][a-z-]+");
  int pages = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path() / "opt/first/share/man/man1")) {
    const std::string file = entry.path().string(), name = entry.path().stem().stem();
    const bool verb = name.starts_with("consort-") && name != "consort-agent" && name != "consort-plant";
    EXPECT_EQ(here("zcat " + file + " | groff -man -Tutf8 -ww -z 2>&1"), "") << file;
    const std::string shown = here("zcat " + file + " | sed 's/\\\\-/-/g'");
    const std::string help = here(std::string(kBinDir) + "/" + (verb ? "consort " + name.substr(8) : name) + " --help");
    for (auto it = std::sregex_iterator(help.begin(), help.end(), option); it != std::sregex_iterator(); ++it)
      EXPECT_NE(shown.find(it->str()), std::string::npos) << name << ": " << it->str();
    ++pages;
  }
  EXPECT_GT(pages, 14);
}

TEST_F(Installation, FishAndZshCompleteWhatIsTyped) {
  const std::string path = "export PATH=$PWD/opt/first/bin:$PATH HOME=$PWD; touch ring.yaml; mkdir -p results; ";
  const auto fish = [&](const std::string& line) {
    return here(path + "fish --no-config -c 'source opt/first/share/fish/vendor_completions.d/consort.fish; complete -C \"" + line + "\"'");
  };
  EXPECT_NE(fish("consort val").find("validate"), std::string::npos);
  EXPECT_NE(fish("consort run --mode re").find("realtime"), std::string::npos);
  EXPECT_NE(fish("consort run ri").find("ring.yaml"), std::string::npos);
  EXPECT_NE(fish("consort list protocols kal").find("kalman_consensus"), std::string::npos);
  EXPECT_NE(fish("consort report res").find("results/"), std::string::npos);
  EXPECT_NE(fish("consort diff --tolerance disag").find("disagreement="), std::string::npos);
  EXPECT_NE(fish("consort-agent --ru").find("--run"), std::string::npos);

  // Keys go to a shell on a terminal of its own once it has shown that it waits for them.
  folder_.write(
      "ask.zsh",
      "zmodload zsh/zpty\n"
      "zpty shell env PS1=READY PROMPT_EOL_MARK= zsh -f -i\n"
      "zpty -r -m shell line '*READY*'\n"
      "zpty -w shell \"fpath=($PWD/opt/first/share/zsh/site-functions \\$fpath); autoload -Uz compinit; compinit -u -D; print lo''aded\"\n"
      "zpty -r -m shell line '*loaded*READY*'\n"
      "for typed in 'val' 'run --mode=real' 'run ri' 'list protocols unbiased_kal' 'diff --tolerance disag'; do\n"
      "  zpty -w -n shell \"consort $typed\"$'\\t\\C-a'\"print -r -- '<\"$'\\C-e'\"done>'\"$'\\n'\n"
      "  zpty -r -m shell line '*<consort*done>*READY*' && print -r -- \"$line\"\n"
      "done\n"
      "zpty -d shell\n");
  const std::string zsh = here(path + "timeout 100 zsh -f ask.zsh");
  for (const char* completed : {"consort validate", "--mode=realtime", "run ring.yaml", "unbiased_kalman_consensus", "disagreement="})
    EXPECT_NE(zsh.find(completed), std::string::npos) << completed << " in\n" << zsh;
}

}  // namespace
}  // namespace consort::package
