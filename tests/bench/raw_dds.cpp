/// A ring or complete graph straight on libddsc: what DDS alone can do on this machine. The step runs in on_data_available; one reader per
/// process, one writer per agent that is heard elsewhere, a partition per agent; best effort, with the last two rounds repeated after a
/// stall. Or rounds by the clock, where nobody is waited for.

#include "tests/bench/paced.hpp"
#include "tests/bench/swarm.hpp"

#include <dds/dds.h>
#include <dds/configuration.hpp>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <condition_variable>
#include <mutex>
#include <optional>
#include <set>

#include "message.h"

namespace consort::bench {
namespace {

static_assert(sizeof(bench_Message) == sizeof(Message));

/// Ends the process: a raw program has nothing to fall back on.
dds_return_t expect(dds_return_t code, const char* what) {
  if (code >= 0) return code;
  std::fprintf(stderr, "raw_dds: %s: %s\n", what, dds_strretcode(code));
  std::_Exit(1);
}

bool port_free(unsigned port) {
  const int descriptor = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  const bool free = bind(descriptor, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  close(descriptor);
  return free;
}

/// A stretch of free ports for every process, four numbers each, below the kernel's own.
unsigned free_port_base(std::uint32_t processes) {
  const unsigned span = 4 * processes + 16;
  for (unsigned attempt = 0; attempt < 64; ++attempt) {
    const unsigned base = 10000 + (static_cast<unsigned>(getpid()) * 97 + attempt * 1999) % (32000 - 10000 - span);
    bool all_free = true;
    for (std::uint32_t p = 0; p < processes && all_free; ++p) {
      const unsigned port = dds::configuration::unicast_port(base + 4 * p);
      all_free = port_free(port) && port_free(port + 1);
    }
    if (all_free) return base;
  }
  std::fprintf(stderr, "raw_dds: no free stretch of %u ports below 32000\n", span);
  std::exit(1);
}

class Process {
  // First, because its return type is deduced and used below.
  auto publish() {
    return [this](std::uint32_t index, const Message& message) { expect(dds_write(writers_[index], &message), "write"); };
  }

 public:
  Process(Swarm& swarm, const Options& options, std::uint32_t process, unsigned port_base, const std::string& tag)
      : swarm_(swarm),
        options_(options),
        process_(process),
        agents_(options.shape, options.agents, options.first(process), options.count(process)) {
    for (std::size_t i = 0; i < buffers_.size(); ++i) pointers_[i] = &buffers_[i];
    if (options.rate > 0.0) paced_.emplace(options.shape, options.agents, process);
    find_neighbours();
    create_entities(port_base, tag);
  }

  void run() {
    {
      std::unique_lock lock(mutex_);
      matched_.wait(lock, [this] { return writers_met_ == writers_wanted_ && readers_met_ == readers_wanted_; });
    }
    swarm_.say_ready(process_);
    swarm_.wait_go();
    if (paced_)
      run_paced();
    else
      run_lockstep();
  }

 private:
  void run_lockstep() {
    {
      const std::lock_guard lock(mutex_);
      agents_.start(publish());
      started_ = true;
      take();
    }
    std::uint64_t before = 0;
    while (!swarm_.stopped(200)) {
      const std::lock_guard lock(mutex_);
      if (agents_.rounds() == before) agents_.repeat(publish());
      before = agents_.rounds();
    }
  }

  void run_paced() {
    {
      const std::lock_guard lock(mutex_);
      started_ = true;
    }
    Slot& slot = swarm_.slot(process_);
    Beats beats(slot.start, 1.0 / options_.rate, options_.rounds());
    beats.run([this](std::uint32_t k) {
      const std::lock_guard lock(mutex_);
      paced_->beat(k, options_.rounds(), [this](const Message& message) { publish()(0, message); });
    });
    slot.jitter_p50 = beats.jitter(0.5);
    slot.jitter_p99 = beats.jitter(0.99);
    slot.jitter_max = beats.jitter(1.0);
    slot.left_out = beats.left_out();
    {
      const std::lock_guard lock(mutex_);
      slot.in_time = paced_->in_time();
    }
    swarm_.say_over();
    while (!swarm_.stopped(1000)) {
    }
  }

  void find_neighbours() {
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      const std::uint32_t id = options_.first(process_) + static_cast<std::uint32_t>(i);
      std::set<std::uint32_t> listening;  // undirected: who is heard hears
      for (const std::uint32_t other : neighbours_of(options_.shape, options_.agents, id)) {
        if (options_.process_of(other) == process_) continue;
        heard_.insert(other);
        listening.insert(options_.process_of(other));
      }
      neighbour_processes_.insert(listening.begin(), listening.end());
      writers_wanted_ += listening.size();
    }
    readers_wanted_ = heard_.size();
  }

  std::string configuration(unsigned port_base, const std::string& tag) const {
    dds::configuration::Settings settings{.tag = tag, .tuned = options_.tuned};
    if (options_.multicast) {
      settings.data = dds::configuration::Data::multicast;
      return dds::configuration::xml(settings);
    }
    settings.discovery = dds::configuration::Discovery::neighbours;
    settings.port_base = static_cast<std::uint16_t>(port_base + 4 * process_);
    for (const std::uint32_t other : neighbour_processes_)
      settings.neighbours.push_back("127.0.0.1:" + std::to_string(dds::configuration::unicast_port(port_base + 4 * other)));
    return dds::configuration::xml(settings);
  }

  void create_entities(unsigned port_base, const std::string& tag) {
    const dds_domainid_t domain = options_.multicast ? 60 + static_cast<dds_domainid_t>(getppid() % 40) : 0;
    expect(dds_create_domain(domain, configuration(port_base, tag).c_str()), "create domain");
    const dds_entity_t participant = expect(dds_create_participant(domain, nullptr, nullptr), "create participant");
    const dds_entity_t topic = expect(dds_create_topic(participant, &bench_Message_desc, "exchange", nullptr, nullptr), "create topic");
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, DDS_RELIABILITY_BEST_EFFORT, 0);
    // A neighbour is at most one round ahead: two samples of each, and as many again for repetitions.
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, static_cast<std::int32_t>(std::max<std::size_t>(16, 4 * heard_.size())));
    dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT);
    create_writers(participant, topic, qos);
    if (!heard_.empty()) create_reader(participant, topic, qos);
    dds_delete_qos(qos);
  }

  static std::string partition_of(std::uint32_t agent) { return "a" + std::to_string(agent); }

  void create_writers(dds_entity_t participant, dds_entity_t topic, const dds_qos_t* qos) {
    dds_listener_t* listener = dds_create_listener(this);
    dds_lset_publication_matched(listener, [](dds_entity_t, const dds_publication_matched_status_t status, void* self) {
      static_cast<Process*>(self)->met(static_cast<Process*>(self)->writers_met_, status.current_count_change);
    });
    writers_.assign(agents_.size(), 0);
    for (std::size_t i = 0; i < agents_.size(); ++i) {
      if (!agents_.heard_elsewhere(i)) continue;
      dds_qos_t* partition = dds_create_qos();
      dds_qset_partition1(partition, partition_of(options_.first(process_) + static_cast<std::uint32_t>(i)).c_str());
      const dds_entity_t publisher = expect(dds_create_publisher(participant, partition, nullptr), "create publisher");
      dds_delete_qos(partition);
      writers_[i] = expect(dds_create_writer(publisher, topic, qos, listener), "create writer");
    }
    dds_delete_listener(listener);
  }

  void create_reader(dds_entity_t participant, dds_entity_t topic, const dds_qos_t* qos) {
    std::vector<std::string> names;
    std::vector<const char*> pointers;
    for (const std::uint32_t id : heard_) names.push_back(partition_of(id));
    for (const std::string& name : names) pointers.push_back(name.c_str());
    dds_qos_t* partition = dds_create_qos();
    dds_qset_partition(partition, static_cast<std::uint32_t>(pointers.size()), pointers.data());
    const dds_entity_t subscriber = expect(dds_create_subscriber(participant, partition, nullptr), "create subscriber");
    dds_delete_qos(partition);
    dds_listener_t* listener = dds_create_listener(this);
    dds_lset_subscription_matched(listener, [](dds_entity_t, const dds_subscription_matched_status_t status, void* self) {
      static_cast<Process*>(self)->met(static_cast<Process*>(self)->readers_met_, status.current_count_change);
    });
    dds_lset_data_available(listener, [](dds_entity_t reader, void* self) {
      auto& process = *static_cast<Process*>(self);
      const std::lock_guard lock(process.mutex_);
      process.reader_ = reader;
      if (process.started_) process.take();
    });
    const dds_entity_t reader = expect(dds_create_reader(subscriber, topic, qos, listener), "create reader");
    dds_delete_listener(listener);
    const std::lock_guard lock(mutex_);
    reader_ = reader;
  }

  void met(std::size_t& count, std::int32_t change) {
    const std::lock_guard lock(mutex_);
    count += static_cast<std::size_t>(change);
    matched_.notify_all();
  }

  void take() {
    if (reader_ == 0) return;
    constexpr std::size_t kBatch = std::tuple_size_v<decltype(buffers_)>;
    dds_return_t count;
    do {
      count = expect(dds_take(reader_, pointers_.data(), infos_.data(), kBatch, kBatch), "take");
      for (dds_return_t i = 0; i < count; ++i)
        if (infos_[static_cast<std::size_t>(i)].valid_data) receive(buffers_[static_cast<std::size_t>(i)]);
    } while (count == static_cast<dds_return_t>(kBatch));
    Slot& slot = swarm_.slot(process_);
    slot.rounds.store(agents_.rounds(), std::memory_order_relaxed);
    slot.delivered.store(paced_ ? paced_->arrived() : agents_.delivered(), std::memory_order_relaxed);
  }

  void receive(const Message& message) {
    if (paced_)
      paced_->receive(message);
    else
      agents_.receive(message, publish());
  }

  Swarm& swarm_;
  const Options& options_;
  std::uint32_t process_;
  Agents agents_;
  std::optional<PacedAgent> paced_;  // instead of them, where the clock paces the rounds
  std::set<std::uint32_t> heard_, neighbour_processes_;
  std::size_t writers_wanted_ = 0, readers_wanted_ = 0, writers_met_ = 0, readers_met_ = 0;
  std::mutex mutex_;
  std::condition_variable matched_;
  bool started_ = false;
  std::vector<dds_entity_t> writers_;
  dds_entity_t reader_ = 0;
  std::array<Message, 32> buffers_{};
  std::array<void*, 32> pointers_{};
  std::array<dds_sample_info_t, 32> infos_{};
};

}  // namespace
}  // namespace consort::bench

int main(int argc, char** argv) {
  using namespace consort::bench;
  CLI::App app{
      "Lockstep rounds, or rounds by the clock, straight on libddsc, on loopback; prints one JSON object.\n"
      "Examples: raw_dds ring 100 --agents-per-process 50; raw_dds ring 100 --rate 100"};
  Options options;
  add_options(app, options);
  app.add_flag("--multicast", options.multicast,
               "multicast discovery and data (right for the complete graph) instead of neighbours and unicast");
  app.add_flag("--tuned", options.tuned, "slower acknowledgements, for the start of about a hundred processes that all meet");
  app.add_option("--rate", options.rate, "rounds per second by the clock, where nobody is waited for; one agent per process")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  if (options.rate > 0.0 && options.agents_per_process != 1) {
    std::fprintf(stderr, "raw_dds: --rate: allowed: one agent per process\n");
    return 2;
  }
  const unsigned port_base = options.multicast ? 0 : free_port_base(options.processes());
  const std::string tag = "raw-" + std::to_string(getpid());
  Swarm swarm(options);
  return swarm.run([&](std::uint32_t process) {
    Process it(swarm, options, process, port_base, tag);
    it.run();
    std::_Exit(0);  // a callback may be running: nothing is torn down under it
  });
}
