/// The page of a run, looked at with a real browser.

#include "tests/page/browser.hpp"
#include "tests/support/tree.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>

namespace consort {
namespace {

using Json = nlohmann::json;

class Page : public testing::Test {
 protected:
  /// Runs an experiment in simulation and gives the address of its page.
  std::string page_of_file(const std::string& file, std::vector<std::string> more = {}) {
    const auto output = folder_.path() / ("run-" + std::to_string(++number_));
    std::vector<std::string> arguments{"run", file, "--mode", "simulate", "--output", output.string(), "--quiet"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    Program run(folder_, "consort", arguments);
    EXPECT_LE(run.wait(), 1) << run.err();  // shortened, so its criteria may not hold
    EXPECT_TRUE(std::filesystem::exists(output / "report.html"));
    EXPECT_LT(std::filesystem::file_size(output / "report.html"), 2'000'000u);
    return "file://" + (output / "report.html").string();
  }
  std::string page_of(const std::string& experiment, std::vector<std::string> more = {}) {
    return page_of_file(std::string(kSourceDir) + "/experiments/" + experiment + ".yaml", std::move(more));
  }
  std::string page_of_text(const std::string& text) {
    return page_of_file(folder_.write("experiment-" + std::to_string(++number_) + ".yaml", text).string());
  }

  /// Every picture has curves with numbers and something drawn, nothing was complained of, and nothing was asked of a network.
  void expect_drawn(std::size_t least) {
    const Json pictures = browser_.run(R"js(
      return drawn.map(({title, graph}) => {
        const numbers = graph.rawData_.reduce((sum, row) => sum + row.slice(1).flat().filter((v) => typeof v === 'number').length, 0);
        const canvas = graph.canvas_.parentNode.querySelectorAll('canvas');
        const pixels = (one) => one.getContext('2d').getImageData(0, 0, one.width, one.height).data;
        const inked = [...canvas].some((one) => one.width > 0 && pixels(one).some((v, i) => i % 4 === 3 && v > 0));
        return {title, numbers, inked};
      });)js");
    EXPECT_GE(pictures.size(), least);
    for (const Json& picture : pictures) {
      EXPECT_GT(picture.at("numbers").get<int>(), 0) << picture.at("title");
      EXPECT_TRUE(picture.at("inked").get<bool>()) << picture.at("title");
    }
    EXPECT_EQ(browser_.run("return performance.getEntriesByType('resource').map((one) => one.name)"), Json::array());
    for (const std::string& line : browser_.console()) EXPECT_FALSE(line.starts_with("SEVERE")) << line;
  }
  /// Every slider says something else at its ends.
  void expect_sliders_to_move(std::size_t count) {
    const Json told = browser_.run(R"js(
      return [...document.querySelectorAll('[data-slider]')].map((slider) => {
        const input = slider.querySelector('input'), output = slider.querySelector('output');
        const at = (value) => { input.value = value; input.dispatchEvent(new Event('input')); return output.textContent; };
        return [input.max, at(0), at(input.max)];
      });)js");
    EXPECT_EQ(told.size(), count);
    for (const Json& one : told)
      if (one[0] != "0") {
        EXPECT_NE(one[1], one[2]);
      }
  }

  Folder folder_;
  Browser browser_{folder_};
  int number_ = 0;
};

TEST_F(Page, ShowsEachKindOfExperiment) {
  browser_.open(page_of("meet_for_dinner"));
  expect_drawn(3);
  expect_sliders_to_move(1);
  EXPECT_EQ(browser_.run("return document.querySelector('.verdict').textContent"), "PASSED");
  EXPECT_EQ(browser_.run("return document.querySelector('h1').textContent"), "meet_for_dinner");

  browser_.open(page_of("localization_single", {"--rounds", "400"}));
  expect_drawn(3);
  expect_sliders_to_move(2);
  EXPECT_EQ(browser_.run("return document.querySelector('.verdict').textContent"), "NOT MET");

  browser_.open(page_of("dlo_kim", {"--rounds", "2000"}));  // an estimator with its truth
  expect_drawn(3);
  EXPECT_TRUE(browser_.run("return runs[0].runs[0].charts.some((chart) => chart.truth !== undefined)").get<bool>());

  browser_.open(page_of("adaptive_ring5_join", {"--rounds", "30000"}));
  expect_drawn(3);
  EXPECT_EQ(browser_.run("return document.querySelectorAll('.strip div').length"), 5) << "who was there";

  browser_.open(page_of("table1_case1", {"--rounds", "40", "--runs", "3"}));  // several protocols, several seeds
  expect_drawn(2);
  browser_.run("document.querySelectorAll('.choice button')[1].click()");
  expect_drawn(3);
}

TEST_F(Page, ShowsAStudyAgainstWhatIsSwept) {
  browser_.open(page_of("studies/loss_study", {"--runs", "5"}));
  expect_drawn(2);
  const Json bias = browser_.run("return {title: drawn[0].title, rows: drawn[0].graph.rawData_, axis: runs[0].study.axis.at}");
  EXPECT_EQ(bias["title"], "bias");
  EXPECT_EQ(bias["axis"], (Json{0, 0.1, 0.2, 0.3, 0.4}));
  const Json record = Json::parse(text_of(folder_.path() / "run-1/summary.json"));
  const std::vector<std::string> losses{"0", "0.1", "0.2", "0.3", "0.4"};
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const Json& row = bias["rows"][i];
    EXPECT_EQ(row.size(), 4U) << "the loss and three algorithms";
    EXPECT_EQ(row[1][1], record["metrics"]["kalman_consensus.kca.loss_" + losses[i] + ".bias"]);
    EXPECT_TRUE(row[1][0] <= row[1][1] && row[1][1] <= row[1][2]) << row;
  }
  EXPECT_EQ(browser_.run("return document.querySelectorAll('table')[0].rows.length"), 16) << "a row per cell";
  browser_.resize(360, 800);
  const Json widths = browser_.run("return [innerWidth, document.documentElement.scrollWidth]");
  EXPECT_LE(widths[1].get<int>(), widths[0].get<int>());
}

TEST_F(Page, FitsASmallScreen) {
  browser_.open(page_of("localization_single", {"--rounds", "200"}));
  browser_.resize(360, 800);
  const Json widths = browser_.run("return [innerWidth, document.documentElement.scrollWidth]");
  EXPECT_LE(widths[1].get<int>(), widths[0].get<int>());
  expect_drawn(3);
}

TEST_F(Page, IsDarkWhereTheReaderIs) {
  const Folder apart;
  Browser dark(apart, true);
  dark.open(page_of("local_voting"));
  const Json colours = dark.run("return [getComputedStyle(document.body).backgroundColor, getComputedStyle(document.body).color]");
  EXPECT_EQ(colours, (Json{"rgb(15, 19, 24)", "rgb(230, 234, 239)"}));
}

TEST_F(Page, LaysSeveralRunsOverEachOther) {
  page_of("local_voting");
  page_of("local_voting", {"--seed", "7"});
  const auto both = folder_.path() / "both.html";
  Program report(folder_, "consort",
                 {"report", (folder_.path() / "run-1").string(), (folder_.path() / "run-2").string(), "--output", both.string()});
  EXPECT_EQ(report.wait(), 0) << report.err();
  browser_.open("file://" + both.string());
  expect_drawn(5);
  EXPECT_EQ(browser_.run("return drawn[0].graph.getLabels().length"), 3) << "the time and two runs in the first picture";
}

TEST_F(Page, FollowsARunThatGoesOn) {
  const auto output = folder_.path() / "live";
  const std::string file =
      folder_
          .write("long.yaml",
                 "experiment: long\nagents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}\nrounds: 20000\n"
                 "dt: 0.01\nmode: realtime\ntopology: ring\ntelemetry: {every: 5}\n")
          .string();
  Program run(folder_, "consort", {"run", file, "--output", output.string(), "--watch"});
  std::string address;
  ASSERT_TRUE(eventually([&] {
    const std::string said = run.err();
    const std::size_t at = said.find("http://127.0.0.1:");
    if (at != std::string::npos && said.find('/', at + 8) != std::string::npos) address = said.substr(at, said.find('/', at + 8) - at + 1);
    return !address.empty() || run.over();
  })) << run.err();
  browser_.open(address);
  const auto points = [&] { return browser_.run("return runs[0].runs.length ? runs[0].runs[0].x.length : 0").get<int>(); };
  int first = 0;
  EXPECT_TRUE(eventually([&] { return (first = points()) > 1; }, 20));
  EXPECT_TRUE(eventually([&] { return points() > first; }, 20)) << "it grows";
  for (const std::string& line : browser_.console()) EXPECT_FALSE(line.starts_with("SEVERE")) << line;
  run.signal(SIGTERM);
  EXPECT_EQ(run.wait(), 143);
}

TEST_F(Page, IsServedToThisHostAloneAndOnlyToRead) {
  page_of("local_voting");
  Program watch(folder_, "consort", {"watch", (folder_.path() / "run-1").string()});
  ASSERT_TRUE(eventually([&] { return watch.out().ends_with("/\n") || watch.over(); })) << watch.err();
  const std::string address = watch.out().substr(0, watch.out().size() - 2);
  const int port = std::stoi(address.substr(address.rfind(':') + 1));
  httplib::Client http("127.0.0.1", port);
  http.set_read_timeout(60);
  const auto page = http.Get("/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_NE(page->body.find("local_voting"), std::string::npos);
  const auto data = http.Get("/data.json");
  ASSERT_TRUE(data);
  EXPECT_EQ(Json::parse(data->body)[0]["experiment"]["name"], "local_voting");
  const auto status = [](const httplib::Result& result) { return result ? result->status : -1; };
  EXPECT_EQ(status(http.Post("/", "x", "text/plain")), 405);
  EXPECT_EQ(status(http.Delete("/")), 405);
  EXPECT_EQ(status(http.Get("/", {{"Host", "elsewhere.example"}})), 403);
  EXPECT_EQ(status(http.Get("/../record.sqlite")), 404);
  // Who connects and says nothing, or half of it, keeps nobody out.
  std::vector<int> silent;
  for (int i = 0; i < 100; ++i) {
    const int one = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    if (connect(one, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) break;
    if (i % 2 == 0) {
      EXPECT_EQ(send(one, "GET / HT", 8, MSG_NOSIGNAL), 8);
    }
    silent.push_back(one);
  }
  httplib::Client patient("127.0.0.1", port);
  patient.set_read_timeout(120);
  EXPECT_EQ(status(patient.Get("/data.json")), 200);
  for (const int one : silent) close(one);
  watch.signal(SIGINT);
  EXPECT_EQ(watch.wait(), 0);
}

TEST_F(Page, RunsNoScriptOfAnExperiment) {
  const std::string attack = "</script><script>document.title='taken'</script><img src=x onerror=\"document.title='taken'\">";
  browser_.open(
      page_of_text("# " + attack +
                   "\nexperiment: x\nagents: {count: 3, protocol: local_voting, initial: {x: {linspace: [0, 1]}}}\nrounds: 20\ndt: 0.1\n"
                   "topology: ring\ncriteria: [\"disagreement < 1\"]\n"));
  expect_drawn(2);
  EXPECT_NE(browser_.run("return document.title"), "taken");
  EXPECT_NE(browser_.run("return document.querySelector('.question').textContent").get<std::string>().find(attack), std::string::npos)
      << "it is text";
}

TEST_F(Page, ShowsNumbersAsTheRecordHasThem) {
  browser_.open(page_of("meet_for_dinner"));
  const auto csv = folder_.path() / "run-1";
  Program exported(folder_, "consort", {"export", csv.string()});
  EXPECT_EQ(exported.wait(), 0);
  const Json shown = browser_.run(R"js(
    const run = runs[0].runs[0], chart = run.charts.find((one) => one.title === 'x');
    return chart.curves.map((curve) => run.y[curve.at]);)js");
  std::ifstream in(csv / "csv" / "estimates.csv");
  std::string line;
  std::getline(in, line);
  EXPECT_TRUE(line.starts_with("run,round,agent,")) << line;
  std::vector<std::string> names;
  std::stringstream head(line);
  for (std::string name; std::getline(head, name, ',');) names.push_back(name);
  const auto x = static_cast<std::size_t>(std::find(names.begin(), names.end(), "x") - names.begin());
  std::size_t compared = 0;
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::stringstream row(line);
    for (std::string field; std::getline(row, field, ',');) fields.push_back(field);
    const auto round = std::stoul(fields[1]), agent = std::stoul(fields[2]);
    EXPECT_EQ(shown.at(agent - 1).at(round).get<double>(), std::stod(fields[x])) << line;
    ++compared;
  }
  EXPECT_EQ(compared, 301u * 10u);
}

}  // namespace
}  // namespace consort
