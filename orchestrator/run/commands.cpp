#include "orchestrator/run/commands.hpp"

#include "orchestrator/run/spread.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string_view>

namespace consort {
namespace {

constexpr double kWaitByHand = 60.0;  // s, as the line to enter says it: what consort-agent takes without being told

// Beside the `consort` of that host.
std::string program_on(const Host& host, bool plant) {
  return (std::filesystem::path(host.consort).parent_path() / (plant ? "consort-plant" : "consort-agent")).string();
}

}  // namespace

std::string shell_word(const std::string& text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-.:/@%+=,";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? "'\\''" : std::string(1, c);
  return word + "'";
}

std::string shell_line(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + shell_word(word);
  return line;
}

std::string line_by_hand(const RunOptions& options, const Placement& placement, const Wiring& wiring, std::size_t process,
                         const std::string& key) {
  const bool plant = process == placement.processes.size();
  const std::size_t host = placement.host_of[process];
  const std::string program = host == kHere ? (plant ? "consort-plant" : "consort-agent") : program_on(options.hosts[host], plant);
  return fmt::format("{}={} {} {} --wait {:g}", kRunKeyVariable, key, shell_word(program), shell_line(wiring.arguments(placement, process)),
                     kWaitByHand);
}

std::string all_commands(const RunOptions& options, const Placement& placement, const Wiring& wiring) {
  std::string text;
  const auto processes_on = [&](auto&& is_there, bool by_hand) {
    for (std::size_t p = 0; p < placement.host_of.size(); ++p) {
      if (!is_there(placement.host_of[p])) continue;
      const bool plant = p == placement.processes.size();
      const bool left_out = plant ? options.external_plant : options.by_hand(placement.processes[p].agents);
      const std::size_t host = placement.host_of[p];
      if (by_hand || left_out)
        text += line_by_hand(options, placement, wiring, p, fmt::format("\"${}\"", kRunKeyVariable)) + "\n";
      else
        text += shell_line({host == kHere ? (plant ? "consort-plant" : "consort-agent") : program_on(options.hosts[host], plant)}) + " " +
                shell_line(wiring.arguments(placement, p)) + "\n";
    }
  };
  const auto is_here = [&](std::size_t host) { return host == kHere || options.hosts[host].launcher == Launcher::local; };
  if (std::any_of(placement.host_of.begin(), placement.host_of.end(), is_here)) {
    text += "# this host\n";
    processes_on(is_here, false);
  }
  for (std::size_t h = 0; h < options.hosts.size(); ++h) {
    const auto is_there = [h](std::size_t host) { return host == h; };
    if (is_here(h) || std::none_of(placement.host_of.begin(), placement.host_of.end(), is_there)) continue;
    const bool by_hand = options.hosts[h].launcher == Launcher::manual;
    text += fmt::format("# {}, {}\n", options.hosts[h].name, by_hand ? "by hand" : "over " + shell_line(connection_to(options.hosts[h])));
    processes_on(is_there, by_hand);
  }
  return text;
}

std::vector<std::string> connection_to(const Host& host) {
  if (host.launcher == Launcher::slurm)
    return {"srun",       "--nodes=1", "--ntasks=1", "--overlap", "--quiet", "--unbuffered", "--nodelist=" + host.machine(),
            host.consort, "lend"};
  // What the user's own configuration says holds for all the rest.
  const bool at_home = host.consort.starts_with("~/");
  const std::string program = at_home ? "~/" + shell_word(host.consort.substr(2)) : shell_word(host.consort);
  return {"ssh", "-T", "-oBatchMode=yes", "-oConnectTimeout=10", "-oClearAllForwardings=yes", host.address, "exec " + program + " lend"};
}

}  // namespace consort
