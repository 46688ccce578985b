#pragma once
/// Two domains in one process that meet on the wire: what one side writes goes through sockets to the other.

#include <dds/dds.hpp>

#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <string>

#include "ping.h"

DDS_TOPIC_TYPE(ping_Ball);
DDS_TOPIC_TYPE(ping_Letter);

namespace ping {

using namespace std::chrono_literals;

/// Long enough for a loaded machine; a test that passes never waits for it.
constexpr auto kPatience = 30s;

inline std::string test_name() {
  const auto* info = testing::UnitTest::GetInstance()->current_test_info();
  return std::string(info->test_suite_name()) + "." + info->name();
}

/// Domain on the wire, different for tests that CTest may run at the same time; ports stay under 32768.
inline std::uint32_t wire_domain() { return 41 + static_cast<std::uint32_t>(std::hash<std::string>{}(test_name()) % 55); }

/// Nobody else on this host uses it.
inline std::string tag() { return test_name() + "-" + std::to_string(getpid()); }

inline std::string configuration(const std::string& discovery_tag = tag()) {
  return dds::configuration::xml({.tag = discovery_tag}) + ",<Discovery><ExternalDomainId>" + std::to_string(wire_domain()) +
         "</ExternalDomainId></Discovery>";
}

/// One side: a configured domain and a participant in it.
struct Side {
  explicit Side(std::uint32_t number, const std::string& xml = configuration()) : domain(number, xml), participant(domain) {}
  dds::domain::Domain domain;
  dds::domain::DomainParticipant participant;
};

struct TwoSides : testing::Test {
  Side here{1}, there{2};
};

/// Waits on `condition` becoming true through the status of `entity`; never on time passing.
inline bool reaches(const dds::core::Entity& entity, dds::core::status::StatusMask mask, const std::function<bool()>& condition) {
  dds::core::cond::StatusCondition status(entity);
  status.enabled_statuses(mask);
  dds::core::cond::WaitSet set;
  set.attach_condition(status);
  const auto give_up = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    const auto left = give_up - std::chrono::steady_clock::now();
    if (left <= 0ns) return false;
    set.wait(std::min<std::chrono::nanoseconds>(left, 50ms));
  }
  return true;
}

template <class T>
bool matches(dds::pub::DataWriter<T>& writer, std::uint32_t readers) {
  return reaches(writer, dds::core::status::StatusMask::publication_matched(),
                 [&] { return writer.publication_matched_status().current_count() == readers; });
}

template <class T>
bool matches(dds::sub::DataReader<T>& reader, std::uint32_t writers) {
  return reaches(reader, dds::core::status::StatusMask::subscription_matched(),
                 [&] { return reader.subscription_matched_status().current_count() == writers; });
}

/// For tests that count every sample. Cyclone reports a match just before it connects the two, and a volatile reader, reliable or not, may
/// miss what is written in between; a transient-local one gets it.
inline dds::sub::qos::DataReaderQos lossless_reader() {
  using namespace dds::core::policy;
  return dds::sub::qos::DataReaderQos() << Reliability::Reliable() << Durability::TransientLocal() << History::KeepAll();
}
inline dds::pub::qos::DataWriterQos lossless_writer() {
  using namespace dds::core::policy;
  return dds::pub::qos::DataWriterQos() << Reliability::Reliable() << Durability::TransientLocal() << History::KeepAll()
                                        << DurabilityService{.history = History::KeepAll()};
}

/// Takes the next valid sample, waiting for it.
template <class T>
bool next(dds::sub::DataReader<T>& reader, T& sample, dds::sub::SampleInfo& info) {
  return reaches(reader, dds::core::status::StatusMask::data_available(), [&] { return reader.take_into(sample, info); });
}

}  // namespace ping
