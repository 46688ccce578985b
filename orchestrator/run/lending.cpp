#include "orchestrator/run/lending.hpp"

#include "core/errors.hpp"
#include "idl/card.hpp"
#include "io/interfaces.hpp"
#include "orchestrator/run/host.hpp"
#include "orchestrator/run/ports.hpp"

#include <dlfcn.h>
#include <fcntl.h>
#include <fmt/format.h>
#include <gnu/libc-version.h>
#include <link.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <csignal>
#include <cstdlib>
#include <memory>
#include <utility>

namespace consort {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

// The file of a library that mathematics loads when it needs it.
std::string library_file(const char* name) {
  void* const library = ::dlopen(name, RTLD_LAZY | RTLD_LOCAL);
  const link_map* map = nullptr;
  if (library == nullptr || ::dlinfo(library, RTLD_DI_LINKMAP, &map) != 0) return "none";
  const std::unique_ptr<char, decltype(&std::free)> file(::realpath(map->l_name, nullptr), &std::free);
  std::string text = file ? file.get() : map->l_name;
  ::dlclose(library);
  return text;
}

}  // namespace

std::string arithmetic_of_this_host() {
  std::string text = fmt::format("glibc {}, BLAS {}", ::gnu_get_libc_version(), library_file("libblas.so.3"));
#if defined(__x86_64__)
  // By these glibc and BLAS choose among their functions, whose last bits may differ.
  __builtin_cpu_init();
  text += fmt::format(", x86-64{}{}{}{}", __builtin_cpu_supports("fma") ? " fma" : "", __builtin_cpu_supports("fma4") ? " fma4" : "",
                      __builtin_cpu_supports("avx2") ? " avx2" : "", __builtin_cpu_supports("avx512f") ? " avx512f" : "");
#else
  text += ", another processor than x86-64";
#endif
  return text;
}

Lending::Lending(std::filesystem::path programs, int in, int out, Examine examine)
    : programs_(std::move(programs)), examine_(std::move(examine)), channel_(in, out), children_(""), heard_(Clock::now()) {}

Lending::~Lending() {
  for (const auto& [name, output] : outputs_) ::close(output);
}

void Lending::tell(const ordered_json& word) { channel_.send(word.dump(-1, ' ', false, json::error_handler_t::replace)); }

std::string Lending::serve() {
  tell({{"lends", wire::Build::own().word()}, {"host", host_name()}, {"pid", ::getpid()}, {"arithmetic", arithmetic_of_this_host()}});
  while (true) {
    wait();
    for (const std::string& line : channel_.take()) {
      try {
        obey(line);
        heard_ = Clock::now();  // what it was told to do may have taken long
      } catch (const std::exception& failure) {
        return fmt::format("found an order that makes no sense ({}); allowed: those of `consort run`", failure.what());
      }
    }
    std::vector<std::string> names;
    for (const auto& [name, output] : outputs_) names.push_back(name);
    for (const std::string& name : names) pass_on(name);
    tell_deaths();
    channel_.flush();
    if (!channel_.open()) return {};
    if (Clock::now() - heard_ > kChannelSilence) return "the run has been silent for 5 s";
  }
}

// For something to read, room to write, a process that ended (its output closes), or a second.
void Lending::wait() {
  std::vector<pollfd> descriptors;
  channel_.wait_for(descriptors);
  for (const auto& [name, output] : outputs_) descriptors.push_back({output, POLLIN, 0});
  constexpr int kSoon = 5, kLater = 1000;  // ms; a process is not gone at the very moment it closes what it has
  const bool ending = children_.alive() > outputs_.size();
  ::poll(descriptors.data(), descriptors.size(), ending ? kSoon : kLater);
}

void Lending::obey(const std::string& line) {
  const json order = json::parse(line);
  if (!order.is_object()) throw RunError("it is no object");
  if (order.contains("ping")) tell({{"pong", 0}});
  if (order.contains("clock")) {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    tell({{"time", std::chrono::duration<double>(now).count()}});
  }
  if (order.contains("examine")) tell({{"examined", examine_(order.at("examine").get<std::string>())}});
  if (order.contains("use")) use(order);
  if (order.contains("start")) start(order);
  if (order.contains("signal")) children_.signal(order.at("signal").get<std::string>(), order.at("number").get<int>());
}

void Lending::use(const json& order) {
  auto address = order.at("use").get<std::string>();
  const auto there = network_interfaces();
  std::string why = interface_refusal(address, there);
  if (why.empty()) {
    const NetworkInterface& found = *find_interface(address, there);
    if (found.name == address) address = found.addresses.front();  // there is one, else it is refused
    for (const auto port : order.at("ports").get<std::vector<std::uint16_t>>())
      if (why.empty() && !port_is_free(port)) why = fmt::format("UDP port {} is taken there; allowed: another range, --ports BASE", port);
  } else {
    why = "--interface: " + why;
  }
  tell({{"used", address}, {"why", why}});
}

void Lending::start(const json& order) {
  const auto name = order.at("start").get<std::string>(), program = order.at("program").get<std::string>();
  const auto key = order.at("key").get<std::string>() + "\n";
  auto arguments = order.at("arguments").get<std::vector<std::string>>();
  arguments.insert(arguments.end(), {"--orchestrator-pid", std::to_string(::getpid()), "--key-on-stdin"});
  std::array<int, 2> input{}, output{};
  try {
    if (program != "consort-agent" && program != "consort-plant") throw RunError(program + " is no program of a run");
    if (::pipe2(input.data(), O_CLOEXEC) != 0 || ::pipe2(output.data(), O_CLOEXEC) != 0) throw RunError("no more files can be opened");
    if (::write(input[1], key.data(), key.size()) != static_cast<ssize_t>(key.size())) throw RunError("a key that no pipe takes");
    const pid_t pid = children_.start(name, programs_ / program, arguments, {}, {input[0], output[1]});
    ::fcntl(output[0], F_SETFL, O_NONBLOCK);
    if (const auto before = outputs_.find(name); before != outputs_.end()) ::close(before->second);
    outputs_[name] = std::exchange(output[0], 0);
    tell({{"started", name}, {"pid", pid}});
  } catch (const RunError& failure) {
    tell({{"failed", name}, {"why", failure.what()}});
  }
  for (const int end : {input[0], input[1], output[0], output[1]})
    if (end != 0) ::close(end);
}

// What a process has written since; once it has closed its end, nothing more comes.
void Lending::pass_on(const std::string& name) {
  std::array<char, 65536> bytes{};
  const auto output = outputs_.find(name);
  if (output == outputs_.end()) return;
  while (true) {
    const ssize_t got = ::read(output->second, bytes.data(), bytes.size());
    if (got > 0) {
      tell({{"log", name}, {"text", std::string(bytes.data(), static_cast<std::size_t>(got))}});
    } else if (got == 0) {
      ::close(output->second);
      outputs_.erase(output);
      return;
    } else if (errno != EINTR) {
      return;
    }
  }
}

void Lending::tell_deaths() {
  while (const auto death = children_.next_death()) {
    pass_on(death->name);
    tell({{"died", death->name}, {"pid", death->pid}, {"signal", death->signal}, {"code", death->exit_code}});
  }
}

}  // namespace consort
