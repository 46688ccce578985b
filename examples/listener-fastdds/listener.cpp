// Prints the estimates of one agent of an open run as they are reported, by another maker's DDS: nothing of Consort but its IDL.
//
//   listener-fastdds DOMAIN AGENT      beside: consort run FILE --open-domain --domain DOMAIN
//
// It ends when the process of that agent has reported for the last time. The reader is best effort, so that the run never waits for it.

#include "consortPubSubTypes.h"

#include <fastdds/rtps/transport/UDPv4TransportDescriptor.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>

#include <cstdio>
#include <cstdlib>
#include <memory>

namespace {

namespace fast = eprosima::fastdds::dds;
namespace rtps = eprosima::fastdds::rtps;
using consort::wire::Telemetry;

// Loopback alone, as runs on one host.
fast::DomainParticipant* join(fast::DomainId_t domain) {
  fast::DomainParticipantQos qos;
  const auto transport = std::make_shared<rtps::UDPv4TransportDescriptor>();
  transport->interfaceWhiteList.emplace_back("127.0.0.1");
  qos.transport().use_builtin_transports = false;
  qos.transport().user_transports.push_back(transport);
  return fast::DomainParticipantFactory::get_instance()->create_participant(domain, qos);
}

fast::DataReader* read_reports(fast::DomainParticipant& participant) {
  const fast::TypeSupport type(new consort::wire::TelemetryPubSubType);
  type.register_type(&participant);
  auto* topic = participant.create_topic("consort_telemetry", type.get_type_name(), fast::TOPIC_QOS_DEFAULT);
  auto* subscriber = participant.create_subscriber(fast::SUBSCRIBER_QOS_DEFAULT);
  fast::DataReaderQos qos;
  qos.reliability().kind = fast::BEST_EFFORT_RELIABILITY_QOS;
  qos.history().kind = fast::KEEP_ALL_HISTORY_QOS;
  // Reports have no bound: memory grows to what the largest one needs.
  qos.endpoint().history_memory_policy = eprosima::fastrtps::rtps::PREALLOCATED_WITH_REALLOC_MEMORY_MODE;
  return topic == nullptr || subscriber == nullptr ? nullptr : subscriber->create_datareader(topic, qos);
}

// True once the agent has been met in a report of this process.
bool show(const Telemetry& telemetry, std::uint32_t agent) {
  bool met = false;
  for (const auto& report : telemetry.members()) {
    if (report.agent() != agent) continue;
    met = true;
    const std::size_t rounds = report.rounds().size(), size = rounds == 0 ? 0 : report.estimates().size() / rounds;
    for (std::size_t r = 0; r < rounds; ++r) {
      std::printf("round %u:", report.rounds()[r]);
      for (std::size_t i = 0; i < size; ++i) std::printf(" %.17g", report.estimates()[r * size + i]);
      std::printf("\n");
    }
  }
  std::fflush(stdout);
  return met;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: listener-fastdds DOMAIN AGENT\n");
    return 2;
  }
  const auto agent = static_cast<std::uint32_t>(std::strtoul(argv[2], nullptr, 10));
  fast::DomainParticipant* participant = join(static_cast<fast::DomainId_t>(std::strtoul(argv[1], nullptr, 10)));
  fast::DataReader* reader = participant == nullptr ? nullptr : read_reports(*participant);
  if (reader == nullptr) {
    std::fprintf(stderr, "listener-fastdds: DDS refuses a participant or a reader in domain %s\n", argv[1]);
    return 1;
  }
  std::fprintf(stderr, "listener-fastdds: waiting for agent %u of domain %s\n", agent, argv[1]);
  bool met = false, over = false;
  std::uint32_t process = 0;  // that hosts the agent
  while (!over) {
    reader->wait_for_unread_message({3600, 0});
    Telemetry telemetry;
    fast::SampleInfo info;
    while (!over && reader->take_next_sample(&telemetry, &info) == eprosima::fastrtps::types::ReturnCode_t::RETCODE_OK) {
      if (!info.valid_data) continue;
      if (show(telemetry, agent)) {
        met = true;
        process = telemetry.process();
      }
      over = met && telemetry.process() == process && telemetry.last();
    }
  }
  participant->delete_contained_entities();
  fast::DomainParticipantFactory::get_instance()->delete_participant(participant);
  return 0;
}
