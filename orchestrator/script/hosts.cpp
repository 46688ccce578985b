#include "orchestrator/script/hosts.hpp"

#include "core/id_list.hpp"
#include "core/number_text.hpp"
#include "orchestrator/script/document.hpp"
#include "orchestrator/script/input_file.hpp"
#include "orchestrator/script/wording.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>

namespace consort {
namespace {

using namespace script;

constexpr std::size_t kLargestHosts = std::size_t{1} << 20;  // bytes
constexpr std::uint64_t kMostSlots = 100'000;

bool is_this_host(std::string_view machine) { return machine == "localhost" || machine == "127.0.0.1" || machine == "::1"; }

// A word that cannot be taken for an option, or for several words, by whoever is handed it.
bool is_word(std::string_view text) {
  return !text.empty() && text.front() != '-' &&
         std::all_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) > ' ' && c != '\x7f'; });
}

// It names a log, too.
bool is_name(std::string_view text) { return is_word(text) && text.find('/') == std::string_view::npos; }

// Whoever says the half of it.
void complete(Host& host, bool launcher_said) {
  if (host.name.empty()) host.name = host.machine();
  if (host.address.empty()) host.address = host.name;
  if (!launcher_said) host.launcher = is_this_host(host.machine()) ? Launcher::local : Launcher::ssh;
}

std::vector<std::uint32_t> read_ids(Mistakes& mistakes, const YAML::Node& node, const std::string& what) {
  if (!node.IsScalar()) {
    mistakes.add(node, fmt::format("{}: found {}; allowed: ids, such as 7 or 1-10,15, with 0 for the plant", what, describe(node)));
    return {};
  }
  try {
    return parse_ids(what, node.Scalar(), 0);
  } catch (const ConfigError& refusal) {
    mistakes.add(node, refusal.what());
    return {};
  }
}

Host read_host(Mistakes& mistakes, const YAML::Node& node, const std::string& what) {
  static const std::vector<std::string> launchers(kLaunchers.begin(), kLaunchers.end());
  const Section section(mistakes, node, what, "/definitions/host");
  Host host;
  if (!section.is_map()) return host;
  const auto word = [&](const char* key, std::string& into, bool path = false) {
    const auto value = section.find(key);
    if (!present(value)) return;
    const auto text = read_text(mistakes, value, section.path(key));
    if (text && (path ? is_word(*text) : is_name(*text)))
      into = *text;
    else if (text)
      mistakes.add(value, fmt::format("{}: found '{}'; allowed: a word {}that begins with no '-'", section.path(key), shown(*text),
                                      path ? "" : "without '/' "));
  };
  word("name", host.name);
  word("address", host.address);
  word("interface", host.interface);
  word("consort", host.consort, true);
  const auto launcher = section.find("launcher"), agents = section.find("agents"), slots = section.find("slots");
  if (present(launcher))
    host.launcher = static_cast<Launcher>(read_choice(mistakes, launcher, section.path("launcher"), launchers).value_or(0));
  if (present(slots)) host.slots = read_whole(mistakes, slots, section.path("slots"), 1, kMostSlots);
  if (present(agents)) host.agents = read_ids(mistakes, agents, section.path("agents"));
  if (present(agents) && present(slots))
    mistakes.add(slots, what + ": found both 'agents' and 'slots'; allowed: one of them, as agents that are named need no slots");
  if (host.name.empty() && host.address.empty()) mistakes.add(node, what + ": found neither 'name' nor 'address'; allowed: one at least");
  complete(host, present(launcher));
  return host;
}

// Two hosts of one name, an agent on two of them.
void check_apart(Mistakes& mistakes, const YAML::Node& node, const std::vector<Host>& hosts) {
  std::set<std::string> names;
  std::map<std::uint32_t, std::string> placed;
  for (const Host& host : hosts) {
    if (!names.insert(host.name).second)
      mistakes.add(node, fmt::format("hosts: found '{}' twice; allowed: a `name` of its own for each", shown(host.name)));
    for (const std::uint32_t id : host.agents)
      if (const auto [at, fresh] = placed.emplace(id, host.name); !fresh)
        mistakes.add(node, fmt::format("hosts: found {} on {} and on {}; allowed: each on one host",
                                       id == 0 ? "the plant (0)" : fmt::format("agent {}", id), shown(at->second), shown(host.name)));
  }
}

// node1 slots=4; a name that comes again is another slot, or as many as it says.
class HostFile {
 public:
  HostFile(Mistakes& mistakes, const std::string& name) : mistakes_(mistakes), name_(name) {}

  std::vector<Host> read(const std::string& text) {
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) {
      ++line_;
      read_line(line.substr(0, line.find('#')));
    }
    return std::move(hosts_);
  }

 private:
  void read_line(const std::string& line) {
    std::istringstream in(line);
    std::string machine, user;
    if (!(in >> machine)) return;
    if (!is_name(machine) || machine.find('=') != std::string::npos)
      return object(fmt::format("found '{}'; allowed: the name of a host, then slots=N", shown(machine)));
    std::optional<std::size_t> slots;
    for (std::string word; in >> word;) {
      const std::string key = word.substr(0, word.find('=')), value = word.substr(std::min(word.find('='), word.size() - 1) + 1);
      const auto count = parse_number<std::uint64_t>(value);
      if (key == "user" && is_word(value))
        user = value;
      else if ((key == "slots" || key == "max_slots" || key == "max-slots") && count && *count >= 1 && *count <= kMostSlots)
        slots = slots && key != "slots" ? std::min(*slots, static_cast<std::size_t>(*count)) : static_cast<std::size_t>(*count);
      else
        return object(fmt::format("found '{}'; allowed: slots=N, max_slots=N, user=NAME", shown(word)));
    }
    const auto known = std::find_if(hosts_.begin(), hosts_.end(), [&](const Host& host) { return host.name == machine; });
    if (known != hosts_.end()) {
      known->slots = known->slots.value_or(1) + slots.value_or(1);
      return;
    }
    Host host{.name = machine, .address = user.empty() ? machine : user + "@" + machine, .slots = slots};
    complete(host, false);
    hosts_.push_back(std::move(host));
  }
  void object(const std::string& text) { mistakes_.add(name_, line_, 1, text); }

  Mistakes& mistakes_;
  std::string name_;
  std::size_t line_ = 0;
  std::vector<Host> hosts_;
};

// As OpenMPI's have it: the first word of the file is a host's name, which begins no list and is no key.
bool is_host_file(const std::string& text) {
  std::istringstream in(text);
  for (std::string line, word; std::getline(in, line);)
    if (std::istringstream words(line.substr(0, line.find('#'))); words >> word)
      return word.front() != '-' && word.front() != '[' && word.front() != '{' && !word.ends_with(':');
  return false;
}

}  // namespace

std::vector<Host> parse_hosts(const std::string& bytes, const std::string& name) {
  Mistakes mistakes(name);
  const std::string text = plain_text(bytes);
  std::vector<Host> hosts;
  if (is_host_file(text)) {
    hosts = HostFile(mistakes, name).read(text);
  } else {
    const YAML::Node document = read_document(text, mistakes);
    mistakes.raise();
    check_duplicate_keys(mistakes, document);
    const YAML::Node list = document.IsMap() ? document["hosts"] : document;
    hosts = read_hosts(mistakes, present(list) ? list : document, ".");
  }
  mistakes.raise();
  return hosts;
}

std::vector<Host> load_hosts(const std::filesystem::path& file) {
  std::string text;
  try {
    text = read_input(file, kLargestHosts);
  } catch (const ConfigError& error) {
    throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
  }
  return parse_hosts(text, file.string());
}

namespace script {

std::vector<Host> read_hosts(Mistakes& mistakes, const YAML::Node& node, const std::filesystem::path& directory) {
  if (node.IsScalar()) {
    try {
      return load_hosts(directory / node.Scalar());
    } catch (const ConfigError& refusal) {
      mistakes.add(node, fmt::format("hosts: {}", refusal.what()));
      return {};
    }
  }
  std::vector<Host> hosts;
  if (!node.IsSequence() || node.size() == 0) {
    mistakes.add(node, fmt::format("hosts: found {}; allowed: a list of hosts, such as {{name: node1, slots: 4}}, or the name of a file "
                                   "with one",
                                   describe(node)));
    return hosts;
  }
  for (std::size_t h = 0; h < node.size(); ++h) hosts.push_back(read_host(mistakes, node[h], fmt::format("hosts[{}]", h + 1)));
  if (mistakes.none()) check_apart(mistakes, node, hosts);
  return hosts;
}

void place_on_hosts(Mistakes& mistakes, const YAML::Node& node, std::vector<Host>& hosts) {
  if (!present(node)) return;
  if (!node.IsMap()) {
    mistakes.add(node, fmt::format("placement.hosts: found {}; allowed: a mapping of names of hosts to ids, such as {{node1: 1-10}}",
                                   describe(node)));
    return;
  }
  std::vector<std::string> names;
  for (const Host& host : hosts) names.push_back(host.name);
  for (const auto& entry : node) {
    const std::string name = entry.first.IsScalar() ? entry.first.Scalar() : std::string();
    const auto host = std::find_if(hosts.begin(), hosts.end(), [&](const Host& each) { return each.name == name; });
    if (host == hosts.end()) {
      mistakes.add(entry.first,
                   fmt::format("placement.hosts: found '{}'; allowed: {}{}", shown(name), listed(names), did_you_mean(name, names)));
      continue;
    }
    host->agents = read_ids(mistakes, entry.second, "placement.hosts." + name);
    host->slots.reset();
  }
  if (mistakes.none()) check_apart(mistakes, node, hosts);
}

YAML::Node hosts_node(const std::vector<Host>& hosts) {
  YAML::Node list(YAML::NodeType::Sequence);
  for (const Host& host : hosts) {
    YAML::Node node(YAML::NodeType::Map);
    node["name"] = host.name;
    node["address"] = host.address;
    node["launcher"] = std::string(name_of(host.launcher));
    if (!host.agents.empty()) node["agents"] = to_text(host.agents);
    if (host.slots) node["slots"] = *host.slots;
    if (!host.interface.empty()) node["interface"] = host.interface;
    node["consort"] = host.consort;
    list.push_back(node);
  }
  return list;
}

}  // namespace script
}  // namespace consort
