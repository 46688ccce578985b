#include "io/standard_streams.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/page.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/watch.hpp"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/wait.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include <csignal>
#include <filesystem>

namespace consort {
namespace {

class ReportVerb : public Verb {
 public:
  explicit ReportVerb(CLI::App& parent) : Verb(*parent.add_subcommand("report", "")) {
    document(
        app_,
        "draw the page of a run, or of several side by side\n"
        "Reads DIR/record.sqlite and what lies beside it, and writes one HTML file that opens from disk and needs no network: verdict and "
        "criteria, the curves of every agent, how far the agents are from each other or from the truth, the network with a slider over its "
        "graphs, the plane where the agents have positions, faults, messages, timing, what theory says, and how to repeat it. `consort "
        "run` "
        "leaves it as report.html in its folder; a run that still goes on, or was killed, is drawn as far as it is recorded. Of several "
        "folders the page begins with all of them in one picture.",
        {{"consort report results/meet_for_dinner-20250131-194500", "Writes report.html into that folder."},
         {"consort report results/* --output all.html", "All runs in one page."}},
        {{"0", "written"}, {"2", "a folder holds no record"}, {"3", "reading or writing failed"}});
    app_.add_option("folders", folders_, "The output folders of runs.")->required()->type_name("DIR");
    app_.add_option("--output", output_,
                    "The file to write. Default: report.html in the folder, or in the current one if there are several.")
        ->type_name("FILE");
    add_output_flags("Print what the page shows as JSON instead of writing it.", "Print nothing but mistakes and failures.");
  }

  Exit execute() override {
    if (json_) {
      nlohmann::ordered_json all = nlohmann::ordered_json::array();
      for (const std::string& folder : folders_) all.push_back(page_data(folder));
      streams::put(fmt::format("{}\n", all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace)));
      return Exit::ok;
    }
    const std::filesystem::path file =
        !output_.empty() ? output_
                         : (folders_.size() == 1 ? std::filesystem::path(folders_.front()) / "report.html" : "report.html").string();
    write_file(file, page_of({folders_.begin(), folders_.end()}));
    show(file.string() + "\n", "");
    return Exit::ok;
  }

 private:
  std::vector<std::string> folders_;
  std::string output_;
};

class WatchVerb : public Verb {
 public:
  explicit WatchVerb(CLI::App& parent) : Verb(*parent.add_subcommand("watch", "")) {
    document(
        app_,
        "show the page of a run in a browser, while it goes on\n"
        "Serves the page of DIR to browsers on this host, at an address that is printed, until interrupted. It reads the record as anybody "
        "may; the run, whoever started it, does not notice. The page follows as the record grows. Nobody on another host is answered.",
        {{"consort watch results/meet_for_dinner-20250131-194500", "Any free port."},
         {"consort watch results/meet_for_dinner-20250131-194500 --port 8080 --open", "A port of one's own, and the browser at once."},
         {"consort run ring.yaml --watch --open", "The same while one starts a run."}},
        {{"0", "interrupted by SIGINT or SIGTERM"}, {"2", "the folder holds no record, or the port is not free"}});
    app_.add_option("folder", folder_, "The output folder of a run.")->required()->type_name("DIR");
    app_.add_option("--port", port_, "Port on 127.0.0.1. Default: any that is free.")->type_name("N")->check(CLI::Range(1, 65535));
    app_.add_flag("--open", open_, "Open a browser.");
  }

  Exit execute() override {
    page_data(folder_);  // says what is wrong with it
    sigset_t ends;
    sigemptyset(&ends);
    sigaddset(&ends, SIGINT);
    sigaddset(&ends, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &ends, nullptr);  // before there are threads: they inherit it
    const Watch watch(folder_, port_);
    streams::put(fmt::format("{}\n", watch.address()));
    if (open_) open_browser(watch.address());
    int signal = 0;
    sigwait(&ends, &signal);
    return Exit::ok;
  }

 private:
  std::string folder_;
  int port_ = 0;
  bool open_ = false;
};

}  // namespace

void open_browser(const std::string& address) {
  const pid_t child = fork();
  if (child < 0) return;
  if (child == 0) {
    if (fork() == 0) {  // nobody waits for it
      execlp("xdg-open", "xdg-open", address.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    _exit(0);
  }
  waitpid(child, nullptr, 0);
}

std::unique_ptr<Verb> make_watch_verb(CLI::App& parent) { return std::make_unique<WatchVerb>(parent); }
std::unique_ptr<Verb> make_report_verb(CLI::App& parent) { return std::make_unique<ReportVerb>(parent); }

}  // namespace consort
