#pragma once
/// The hosts of a run, as a file lists them: where processes are started, how, and how many of them or which agents. They say where an
/// experiment runs, not what it is: no result depends on them.

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace YAML {  // NOLINT(readability-identifier-naming): as the library has it
class Node;
}

namespace consort {

namespace script {
class Mistakes;
}

/// Who starts the processes of a host: `consort run` itself, a connection with ssh, a person, or a connection that Slurm makes.
enum class Launcher { local, ssh, manual, slurm };
inline constexpr std::array<std::string_view, 4> kLaunchers{"local", "ssh", "manual", "slurm"};
constexpr std::string_view name_of(Launcher launcher) { return kLaunchers[static_cast<std::size_t>(launcher)]; }
/// Processes of such a host are started over a connection to it.
constexpr bool is_connected(Launcher launcher) { return launcher == Launcher::ssh || launcher == Launcher::slurm; }

struct Host {
  std::string name;          ///< for a person; no other host has it
  std::string address = {};  ///< as ssh takes it: [USER@]NAME
  Launcher launcher = Launcher::ssh;
  std::vector<std::uint32_t> agents = {};  ///< that it hosts, ascending, 0 for the plant; empty: as many as there are slots
  std::optional<std::size_t> slots = {};   ///< processes it takes at most; nullopt: an even share of what is left
  std::string interface = {};              ///< name or address of the one to the other hosts; empty: where `address` leads
  std::string consort = "consort";         ///< the program on that host; consort-agent and consort-plant lie beside it

  bool operator==(const Host&) const = default;
  /// `address` without the user.
  [[nodiscard]] std::string machine() const { return address.substr(address.find('@') + 1); }
};

/// Of a file with nothing but hosts: a list as `hosts:` of an experiment has it, such a mapping, or a host file as OpenMPI takes it
/// (`node1 slots=4`). Throws ConfigError.
std::vector<Host> load_hosts(const std::filesystem::path& file);
std::vector<Host> parse_hosts(const std::string& bytes, const std::string& name);

namespace script {

/// `node`: the list, or the name of such a file, found from `directory`.
std::vector<Host> read_hosts(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory);
/// `node`: of each host's name, the agents it hosts, whatever its entry says of agents and slots.
void place_on_hosts(Mistakes& mistakes, const YAML::Node& node, std::vector<Host>& hosts);
YAML::Node hosts_node(const std::vector<Host>& hosts);

}  // namespace script
}  // namespace consort
