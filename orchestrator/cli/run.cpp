#include "core/counted.hpp"
#include "core/id_list.hpp"
#include "core/option_text.hpp"
#include "io/standard_streams.hpp"
#include "orchestrator/cli/by_hand.hpp"
#include "orchestrator/cli/help.hpp"
#include "orchestrator/cli/scribe.hpp"
#include "orchestrator/cli/signals.hpp"
#include "orchestrator/cli/study_command.hpp"
#include "orchestrator/cli/verbs.hpp"
#include "orchestrator/report/findings.hpp"
#include "orchestrator/report/left_out.hpp"
#include "orchestrator/report/page.hpp"
#include "orchestrator/report/results.hpp"
#include "orchestrator/report/table.hpp"
#include "orchestrator/report/watch.hpp"
#include "orchestrator/run/commands.hpp"
#include "orchestrator/run/dds_configuration.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/host_addresses.hpp"
#include "orchestrator/run/ports.hpp"
#include "orchestrator/run/slurm.hpp"
#include "orchestrator/run/spread.hpp"
#include "orchestrator/script/script.hpp"
#include "protocols/registry.hpp"
#include "rounds/last_round.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <csignal>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>

namespace consort {
namespace {

constexpr std::size_t kLongestRunName = 100;  // it is the tag by which processes find each other

class RunVerb : public Verb {
 public:
  RunVerb(CLI::App& parent, std::vector<std::string> command_line);
  Exit execute() override;
  Exit abandon(Exit exit, const std::string& error) override;

 private:
  void check_options() const;
  std::filesystem::path make_output() const;
  [[nodiscard]] RunOptions options() const;
  void plan();
  [[nodiscard]] bool is_study();
  [[nodiscard]] Exit execute_study();
  Exit conclude(Summary summary) const;
  std::string write_page(std::string& page) const;
  [[nodiscard]] int port_to_watch() const;

  std::vector<std::string> command_line_;
  std::filesystem::path file_, output_option_;
  std::string mode_, run_name_, interface_ = "lo";
  ScriptOverrides overrides_;
  std::optional<int> domain_;
  std::vector<std::string> external_texts_;
  std::vector<std::uint32_t> external_;  // ascending; 0: the plant
  std::filesystem::path hosts_file_;
  std::string launcher_;
  std::optional<unsigned> first_port_;
  bool force_ = false, no_report_ = false, open_ = false, open_domain_ = false, dry_run_ = false;
  StudyCommand study_;
  std::string text_;        // of the file
  std::string watch_port_;  // a number, or any; empty: nobody watches

  Experiment experiment_;
  std::vector<Host> hosts_;
  RunOptions run_options_;
  std::vector<std::string> by_hand_;  // what to enter
  std::string commands_;              // of every host, for --dry-run
  std::filesystem::path output_;
  std::optional<Scribe> scribe_;  // there from the moment the output folder holds anything
  std::optional<Watch> watch_;
};

RunVerb::RunVerb(CLI::App& parent, std::vector<std::string> command_line)
    : Verb(*parent.add_subcommand("run", "")), command_line_(std::move(command_line)) {
  document(
      app_,
      "run an experiment\n"
      "Runs the experiment in FILE, shows how it goes on standard error, prints a table of the results and keeps everything in a folder of "
      "its own: the resolved experiment (experiment.yaml), seed, versions and host (host.json), all figures (summary.json), every reported "
      "estimate (record.sqlite, see `consort export`), what theory says of it (theory.json), one log per process (logs/), and a page that "
      "shows it all (report.html, see `consort report`). What "
      "the command line says wins over the file.",
      {{"consort run experiments/meet_for_dinner.yaml", "Ten agent processes over DDS."},
       {"consort run experiments/kalman_bias.yaml --mode simulate --runs 100 --seed 1",
        "A hundred simulations on all cores: mean ± std of each metric."},
       {"consort run ring.yaml --json --quiet | jq .metrics.bias", "One number for a script."},
       {"consort run ring.yaml --hosts hosts.yaml --dry-run", "What would be started on which host, and how."},
       {"consort run ring.yaml --external 7 --name demo --domain 3",
        "Everybody but agent 7, which is then started by hand; the line to do it with is printed, and holds the run's key (taken from "
        "CONSORT_KEY where that is set)."}},
      {{"0", "all criteria are met"},
       {"1", "a criterion was not met"},
       {"2", "bad input: the command line or the experiment file; nothing was run"},
       {"3",
        "an agent or the run failed, or output cannot be written; the text names it. Also: the run is incomplete, as an agent that was to "
        "be there did not report the last round; criteria then show their values and are not met"},
       {"4", "timed out; the text says who was missing or who waited for whom"},
       {"130, 143", "interrupted by SIGINT, SIGTERM; what was recorded is intact"}});
  app_.add_option("file", file_, "The experiment (YAML).")->type_name("FILE");
  app_.add_option("--mode", mode_,
                  "simulate: no processes and no clock; lockstep: real processes that wait for each other; realtime: real processes on the "
                  "wall clock, a round every dt. Default: the file's.")
      ->type_name("MODE")
      ->check(one_of({"simulate", "lockstep", "realtime"}));
  const auto whole = [this](const std::string& name, auto& into, std::uint64_t low, std::uint64_t high, const std::string& meaning) {
    app_.add_option_function<std::string>(
            name, [&into, name, low, high](const std::string& text) { into = whole_option(name, text, low, high); }, meaning)
        ->type_name("N");
  };
  constexpr std::uint64_t kAny = std::numeric_limits<std::uint64_t>::max();
  whole("--seed", overrides_.seed, 0, kAny, "Seed of every random draw. Default: the file's.");
  whole("--rounds", overrides_.rounds, 1, kMostRounds, "Most rounds to run. Default: the file's.");
  whole("--runs", overrides_.runs, 1, kMostRuns,
        "Repetitions with the seeds N, N+1, ...; a metric is then the mean over the runs that have it, <metric>.std their "
        "deviation, <metric>.share their share. Default: the file's.");
  whole("--agents-per-process", overrides_.agents_per_process, 1, kAny,
        "How many agents share a process; never changes a result. Default: the file's.");
  study_.add_options(app_);
  app_.add_option("--output", output_option_, "Folder for the results, absent or empty. Default: results/<experiment>-<time>.")
      ->type_name("DIR");
  add_output_flags("Print summary.json on standard output instead of the table; where nothing was run, why.",
                   "No table, and nothing on standard error but mistakes, failures, and what --external is to be entered with.");
  app_.add_flag(
          "--watch{any}", watch_port_,
          "Show the page of the run in a browser while it goes on, at an address that is printed; --watch=PORT for a port of one's own.")
      ->type_name("PORT");
  app_.add_flag("--open", open_, "With --watch: open a browser.");
  app_.add_flag("--no-report", no_report_, "Draw no page (report.html); `consort report` does it later.");
  app_.add_flag("--force", force_, "Run also what theory refuses: estimators that cannot see what they are to estimate, for example.");
  app_.add_option("--name", run_name_, "Name of the run on the network; unique among those that run. Default: <experiment>-<random>.")
      ->type_name("RUN");
  whole("--domain", domain_, 0, 230, "DDS domain, 0 to 230. Default: derived from the name.");
  app_.add_flag("--open-domain", open_domain_,
                "Let other DDS programs of the domain (0, unless --domain says another) read the run: found by multicast on the domain's "
                "well-known ports, without the tag that keeps runs apart. Who writes is left out as ever.");
  app_.add_option("--interface", interface_,
                  "Network interface (name or address) of all processes, for agents on other hosts. Default: lo.")
      ->type_name("NAME");
  app_.add_option("--external", external_texts_,
                  "Agents that are started by hand, such as 7, 11-40 or 0,3,11-40, with 0 for the plant; they are waited for.")
      ->type_name("IDS")
      ->allow_extra_args(false);
  app_.add_option("--hosts", hosts_file_,
                  "Where the processes run: a list of hosts (YAML), or a host file as OpenMPI takes it. Default: the file's `hosts`, else "
                  "this host.")
      ->type_name("FILE");
  app_.add_option("--launcher", launcher_,
                  "slurm: the hosts are the nodes of the Slurm allocation this is run in, see deploy/slurm/run.sbatch.")
      ->type_name("NAME")
      ->check(one_of({"slurm"}));
  whole("--ports", first_port_, 1024, 65000,
        "With several hosts: the first of the UDP ports of the run, for firewalls; four for each process, and for every 20 of them. "
        "Default: free ones above 10240.");
  app_.add_flag("--dry-run", dry_run_, "Start nothing: print every command of every host.");
}

void RunVerb::check_options() const {
  const Round rounds = last_round(experiment_);
  if (const double needed = rounds * experiment_.dt; experiment_.mode == Mode::realtime && needed >= experiment_.deadline)
    throw ConfigError(
        fmt::format("mode realtime: found {} of {:g} s, which take {:g} s by the wall clock, and a deadline of {:g} s; "
                    "allowed: "
                    "fewer rounds, a shorter dt, or a later `stop: {{deadline: ...}}`",
                    counted(rounds, "round"), experiment_.dt, needed, experiment_.deadline));
  const bool struck_outside = std::any_of(experiment_.faults.begin(), experiment_.faults.end(), [&](const Fault& fault) {
    return std::find(external_.begin(), external_.end(), fault.agent.value) != external_.end();
  });
  if (struck_outside)
    throw ConfigError(
        "--external: found an agent whose process the file kills or stops; allowed: agents without such events, since only "
        "processes that are launched here can be");
  if (experiment_.mode == Mode::simulate)
    for (const auto& [option, given] :
         {std::pair("--external", !external_.empty()), std::pair("--hosts", !hosts_file_.empty()),
          std::pair("--launcher", !launcher_.empty()), std::pair("--dry-run", dry_run_), std::pair("--open-domain", open_domain_)})
      if (given)
        throw ConfigError(fmt::format("{}: found mode simulate; allowed: mode lockstep or realtime, where agents are processes", option));
  if (open_domain_ && experiment_.discovery == Discovery::neighbours)
    throw ConfigError("--open-domain: found discovery neighbours, where nobody else can find the run; allowed: multicast or auto");
  if (experiment_.discovery == Discovery::neighbours && interface_ != "lo" && hosts_.empty())
    throw ConfigError(
        "--interface: found discovery neighbours, which knows this host's processes only; allowed: discovery multicast or auto");
  if (experiment_.mode != Mode::simulate) {
    if (const std::string refusal = interface_refusal(interface_); !refusal.empty()) throw ConfigError("--interface: " + refusal);
    const auto unfit = [](char c) { return static_cast<unsigned char>(c) <= ' ' || c == '\x7f'; };
    if (run_name_.size() > kLongestRunName || std::any_of(run_name_.begin(), run_name_.end(), unfit))
      throw ConfigError(
          fmt::format("--name: found {}; allowed: up to {}, without spaces", counted(run_name_.size(), "byte"), kLongestRunName));
    if (const auto faults = configuration_faults(configuration_of_environment()); !faults.refusals.empty())
      throw ConfigError("CYCLONEDDS_URI: " + faults.refusals.front());
    if (!configuration_of_environment().empty()) try_domain(interface_);
  }
  for (const std::uint32_t id : external_) {
    if (id == 0 && !experiment_.plant)
      throw ConfigError("--external: found 0, the plant; allowed: agents only, the experiment has no plant");
    if (id > experiment_.agents) throw ConfigError(fmt::format("--external: found agent {}; allowed: 1 to {}", id, experiment_.agents));
  }
}

std::set<std::uint32_t> ids_in(const std::string& text) {
  const std::vector<std::uint32_t> ids = parse_ids("--external", text, 0);
  return {ids.begin(), ids.end()};
}

std::filesystem::path RunVerb::make_output() const {
  if (output_option_.empty()) return create_results_folder("results", experiment_.name, std::time(nullptr));
  claim_output_folder(output_option_);
  return output_option_;
}

RunOptions RunVerb::options() const {
  RunOptions options;
  options.run_name = run_name_.empty() ? random_run_name(experiment_.name) : run_name_;
  options.domain = domain_.value_or(-1);
  options.open_domain = open_domain_;
  if (open_domain_ && !domain_) options.domain = 0;
  options.interface = interface_;
  options.key = run_key();
  // Whoever starts an agent by hand needs to know the domain beforehand. (Above 99, ports of a domain meet those the kernel gives out.)
  if (!external_.empty() && options.domain < 0) options.domain = static_cast<int>(Purpose(options.run_name).hash % 100);
  options.agent_executable = program_folder() / "consort-agent";
  for (const std::uint32_t id : external_) {
    if (id == 0)
      options.external_plant = true;
    else
      options.external.push_back(AgentId{id});
  }
  options.interrupt = &caught_signal();
  options.hosts = hosts_;
  return options;
}

// Who runs where and is found how, as far as somebody is to be told; whatever keeps processes from being placed so is said now.
void RunVerb::plan() {
  run_options_ = options();
  if (experiment_.mode == Mode::simulate) return;
  if (hosts_.empty() && external_.empty() && !dry_run_ && !first_port_) return;
  Experiment placed = experiment_;
  placed.rounds = last_round(experiment_);
  Placement placement = place_for(placed, run_options_);
  for (const Fault& fault : experiment_.faults)
    if (const std::size_t host = placement.host_of[placement.process_of[index_of(fault.agent)]];
        host != kHere && hosts_[host].launcher == Launcher::manual)
      throw ConfigError(
          fmt::format("hosts: found agent {}, whose process the file kills or stops, on {}, which is started by hand; allowed: "
                      "on a host with another launcher",
                      fault.agent.value, hosts_[host].name));
  find_addresses(run_options_, placement);
  if (!hosts_.empty() && run_options_.hosts.empty()) placement = place_for(placed, run_options_);
  Wiring wiring = Wiring::of(placed, run_options_, placement);
  if (first_port_ && !wiring.neighbours)
    throw ConfigError(
        "--ports: found a run whose processes find each other by multicast; allowed: with --hosts, or `discovery: neighbours`");
  std::shared_ptr<PortBlock> ports;
  if (first_port_)
    ports = std::make_shared<PortBlock>(wiring.ports(), static_cast<std::uint16_t>(*first_port_));
  else if (wiring.ports() > 0)
    ports = std::make_shared<PortBlock>(wiring.ports());
  if (ports) wiring.first_port = ports->first();
  if (wiring.neighbours) run_options_.ports = ports;
  by_hand_ = commands_by_hand(placed, run_options_, placement, wiring);
  if (dry_run_) commands_ = all_commands(run_options_, placement, wiring);
}

bool estimates(const Experiment& experiment) {
  return std::any_of(experiment.protocols.begin(), experiment.protocols.end(),
                     [](const ProtocolChoice& choice) { return find_protocol(choice.name).truth != Truth::none; });
}

bool RunVerb::is_study() {
  if (file_.empty() && !study_.resumes()) throw ConfigError("file is required, or --resume DIR; see `consort run --help`");
  if (!file_.empty() && study_.resumes())
    throw ConfigError("--resume: found a FILE, too; allowed: one of them, as the folder of a study holds its experiment");
  if (study_.resumes()) return true;
  text_ = experiment_text(file_);
  return study_.is_study(text_, file_.string(), overrides_);
}

Exit RunVerb::execute_study() {
  for (const char* option :
       {"--external", "--hosts", "--launcher", "--ports", "--dry-run", "--watch", "--name", "--domain", "--open-domain", "--interface"})
    if (app_.get_option(option)->count() > 0)
      throw ConfigError(fmt::format("{}: found a study; allowed: with a single run, whose cells have one value for each key", option));
  const StudySetting setting{file_, output_option_, overrides_, command_line_, force_, no_report_, quiet_};
  return study_.execute(setting, text_, [this](const auto& text, const auto& json) { show(text, json); });
}

Exit RunVerb::execute() {
  if (!mode_.empty()) overrides_.mode = mode_ == "simulate" ? Mode::simulate : mode_ == "lockstep" ? Mode::lockstep : Mode::realtime;
  std::set<std::uint32_t> external;
  for (const std::string& text : external_texts_) external.merge(ids_in(text));
  external_.assign(external.begin(), external.end());
  if (!hosts_file_.empty() && !launcher_.empty()) throw ConfigError("--launcher: found --hosts, too; allowed: one of them");
  if (!hosts_file_.empty()) overrides_.hosts = load_hosts(hosts_file_);
  if (!launcher_.empty()) overrides_.hosts = hosts_of_allocation();
  if (is_study()) return execute_study();
  experiment_ = parse_experiment(text_, file_.string(), file_.parent_path(), overrides_, &hosts_);
  check_options();
  const std::vector<Finding> findings = examine(experiment_, Effort::of_run());
  if (!force_) refuse_unsound(findings);
  plan();
  if (dry_run_) {
    streams::put(commands_);
    return Exit::ok;
  }
  catch_signals();
  output_ = make_output();
  run_options_.log_directory = output_ / "logs";
  run_options_.spill_directory = output_;
  if (!watch_port_.empty()) watch_.emplace(output_, port_to_watch());
  std::filesystem::create_directory(output_ / "logs");
  write_file(output_ / "experiment.yaml", experiment_.resolved_text);
  write_file(output_ / "host.json",
             host_facts(experiment_, command_line_).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  scribe_.emplace(experiment_, output_, quiet_);
  if (watch_) {
    scribe_->note("watch: " + watch_->address());
    if (open_) open_browser(watch_->address());
  }
  if (open_domain_)
    scribe_->note(
        fmt::format("open: every DDS program of domain {} on this network sees the run, and it sees them; who does not belong "
                    "to it is not heard",
                    run_options_.domain));
  if (experiment_.mode != Mode::simulate && configuration_faults(configuration_of_environment()).no_multicast)
    scribe_->note("CYCLONEDDS_URI turns multicast off: processes that find each other by it never will");
  write_file(output_ / "theory.json", to_json(findings).dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
  for (const std::string& line : told(findings, estimates(experiment_), style_of(STDERR_FILENO))) scribe_->note(line);
  for (const std::string& line : left_out_of_record(experiment_)) scribe_->remark(line);
  // Nobody else can enter them: the key, and often name and domain, are of this run alone.
  for (const std::string& line : by_hand_) {
    if (quiet_)
      streams::tell(line + "\n");
    else
      scribe_->note(line);
  }
  try {
    scribe_->set_times(experiment_.mode == Mode::simulate ? run_simulated(experiment_, run_options_, *scribe_)
                                                          : run_processes(experiment_, run_options_, *scribe_));
  } catch (const SeedRefused& refused) {
    // Read with that seed, the file is refused with the place.
    overrides_.seed = refused.seed.value;
    static_cast<void>(parse_experiment(text_, file_.string(), file_.parent_path(), overrides_));
    throw;
  }
  scribe_->close();
  const int signal = caught_signal().load();
  const Summary summary = signal == 0 ? scribe_->summary(Exit::ok, "")
                                      : scribe_->summary(interrupted_exit(signal), fmt::format("interrupted by {} after round {} of {}",
                                                                                               signal == SIGINT ? "SIGINT" : "SIGTERM",
                                                                                               scribe_->round(), experiment_.rounds));
  scribe_->conclude(summary);
  const Exit exit = conclude(summary);
  if (signal == 0 && !summary.complete) say("incomplete: " + summary.incomplete);
  scribe_.reset();
  return exit;
}

Exit RunVerb::abandon(Exit exit, const std::string& error) {
  if (!scribe_) return Verb::abandon(exit, error);
  // A signal may reach the run as a failure of its own, for example of a wait it interrupted.
  if (const int signal = caught_signal().load(); signal != 0) exit = interrupted_exit(signal);
  const std::string lost = scribe_->abandon();
  const Summary summary = scribe_->summary(exit, error);
  try {
    scribe_->conclude(summary);
  } catch (const RunError&) {
    // The record may be what failed: `error` says so, and the rest is still told.
  }
  exit = conclude(summary);
  if (!lost.empty()) say(lost);
  return exit;
}

int RunVerb::port_to_watch() const {
  if (watch_port_ == "any") return 0;
  int port = 0;
  const auto [end, error] = std::from_chars(watch_port_.data(), watch_port_.data() + watch_port_.size(), port);
  if (error != std::errc() || end != watch_port_.data() + watch_port_.size() || port < 1 || port > 65535)
    throw ConfigError(fmt::format("--watch: found '{}'; allowed: a port from 1 to 65535, or nothing: a free one", watch_port_));
  return port;
}

// What came in its way, or nothing: the record and the table are what counts, and `consort report` can draw the page later.
std::string RunVerb::write_page(std::string& page) const {
  try {
    const auto file = output_ / "report.html";
    write_file(file, page_of({output_}));
    page = file.string();
    return "";
  } catch (const std::runtime_error& failure) {
    return fmt::format("no page was drawn: {}", failure.what());
  }
}

// The results are shown whether they can be kept or not.
Exit RunVerb::conclude(Summary summary) const {
  std::string lost;
  try {
    write_file(output_ / "summary.json", to_json(summary));
  } catch (const RunError& failure) {
    lost = fmt::format("{}; the results are shown, but not kept there", failure.what());
    if (summary.error.empty()) summary.error = failure.what();
    if (summary.exit == Exit::ok || summary.exit == Exit::criterion_not_met) summary.exit = Exit::run_failed;
  }
  std::string page;
  if (!no_report_ && lost.empty()) lost = write_page(page);
  show(render(summary, style_of(STDOUT_FILENO)) + (page.empty() ? "" : fmt::format("  {}\n", page)), to_json(summary));
  if (!lost.empty()) say(lost);
  return summary.exit;
}

}  // namespace

std::unique_ptr<Verb> make_run_verb(CLI::App& parent, std::vector<std::string> command_line) {
  return std::make_unique<RunVerb>(parent, std::move(command_line));
}

}  // namespace consort
