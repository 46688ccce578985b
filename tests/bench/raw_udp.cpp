/// A ring or complete graph over UDP sockets: what the kernel alone can do on this machine. One socket and one thread per process,
/// neighbours in one process by direct call; the last two rounds are repeated after a stall. With --multicast one datagram reaches
/// everybody.

#include "tests/bench/swarm.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <map>
#include <set>

namespace consort::bench {
namespace {

int expect(int result, const char* what) {
  if (result >= 0) return result;
  std::fprintf(stderr, "raw_udp: %s: %s\n", what, std::generic_category().message(errno).c_str());
  std::_Exit(1);
}

sockaddr_in loopback(std::uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(port);
  return address;
}

class Process {
  // First, because its return type is deduced and used below.
  auto publish() {
    return [this](std::uint32_t index, const Message& message) {
      for (const sockaddr_in& to : listeners_[index])
        expect(static_cast<int>(sendto(out_, &message, sizeof message, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to)), "send");
    };
  }

 public:
  Process(Swarm& swarm, const Options& options, std::uint32_t process, std::uint16_t group_port)
      : swarm_(swarm),
        options_(options),
        process_(process),
        agents_(options.shape, options.agents, options.first(process), options.count(process)) {
    open_socket();
    if (options.multicast) join_group(group_port);
  }

  void run() {
    swarm_.say_ready(process_);
    swarm_.wait_go();
    find_listeners();
    agents_.start(publish());
    for (;;) {
      pollfd descriptors[2] = {{in_, POLLIN, 0}, {swarm_.stop_descriptor(), POLLIN, 0}};
      Message message;
      // The socket is tried before it is waited for: under load the next message is there already.
      const ssize_t got = recv(in_, &message, sizeof message, MSG_DONTWAIT);
      if (got == sizeof message) {
        agents_.receive(message, publish());
        Slot& slot = swarm_.slot(process_);
        slot.rounds.store(agents_.rounds(), std::memory_order_relaxed);
        slot.delivered.store(agents_.delivered(), std::memory_order_relaxed);
        if (++received_ % 64 != 0) continue;
        if (swarm_.stopped(0)) return;
        continue;
      }
      const int ready = poll(descriptors, 2, 200);
      if (descriptors[1].revents != 0) return;
      if (ready == 0) agents_.repeat(publish());
    }
  }

 private:
  void open_socket() {
    out_ = expect(socket(AF_INET, SOCK_DGRAM, 0), "socket");
    const sockaddr_in any = loopback(0);
    expect(bind(out_, reinterpret_cast<const sockaddr*>(&any), sizeof any), "bind");
    sockaddr_in bound{};
    socklen_t size = sizeof bound;
    expect(getsockname(out_, reinterpret_cast<sockaddr*>(&bound), &size), "getsockname");
    swarm_.slot(process_).port = ntohs(bound.sin_port);
    in_ = out_;
    enlarge(in_);
  }

  static void enlarge(int descriptor) {
    const int bytes = 4 << 20;
    expect(setsockopt(descriptor, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes), "set receive buffer");
  }

  void join_group(std::uint16_t port) {
    in_ = expect(socket(AF_INET, SOCK_DGRAM, 0), "socket");
    enlarge(in_);
    const int on = 1;
    expect(setsockopt(in_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on), "share port");
    group_ = loopback(port);
    group_.sin_addr.s_addr = inet_addr("239.255.77.1");
    expect(bind(in_, reinterpret_cast<const sockaddr*>(&group_), sizeof group_), "bind to group");
    ip_mreqn membership{};
    membership.imr_multiaddr = group_.sin_addr;
    membership.imr_address.s_addr = htonl(INADDR_LOOPBACK);
    expect(setsockopt(in_, IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership), "join group");
    expect(setsockopt(out_, IPPROTO_IP, IP_MULTICAST_IF, &membership, sizeof membership), "choose interface");
  }

  /// Where each agent's messages go. Ports are known once everybody is ready.
  void find_listeners() {
    listeners_.resize(agents_.size());
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      if (options_.multicast) {
        listeners_[i] = {group_};
        continue;
      }
      std::set<std::uint32_t> processes;
      for (const std::uint32_t other :
           neighbours_of(options_.shape, options_.agents, options_.first(process_) + static_cast<std::uint32_t>(i)))
        if (options_.process_of(other) != process_) processes.insert(options_.process_of(other));
      for (const std::uint32_t other : processes)
        listeners_[i].push_back(loopback(static_cast<std::uint16_t>(swarm_.slot(other).port.load())));
    }
  }

  Swarm& swarm_;
  const Options& options_;
  std::uint32_t process_;
  Agents agents_;
  int in_ = -1, out_ = -1;
  sockaddr_in group_{};
  std::vector<std::vector<sockaddr_in>> listeners_;
  std::uint64_t received_ = 0;
};

}  // namespace
}  // namespace consort::bench

int main(int argc, char** argv) {
  using namespace consort::bench;
  CLI::App app{"Lockstep rounds over UDP sockets, on loopback; prints one JSON object.\nExample: raw_udp complete 50 --multicast"};
  Options options;
  add_options(app, options);
  app.add_flag("--multicast", options.multicast, "one datagram to everybody instead of one per neighbour");
  CLI11_PARSE(app, argc, argv);
  const auto group_port = static_cast<std::uint16_t>(20000 + getpid() % 10000);
  Swarm swarm(options);
  return swarm.run([&](std::uint32_t process) {
    Process it(swarm, options, process, group_port);
    it.run();
    std::_Exit(0);  // a callback may be running: nothing is torn down under it
  });
}
