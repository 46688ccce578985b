#pragma once
/// C++ binding over libddsc (Cyclone DDS 0.10): a small subset of the ISO/IEC C++ DDS API, same names. See core.hpp for the differences.
///
///   dds::domain::Domain domain(7, dds::domain::with_user_configuration(dds::configuration::xml({.tag = "my-run"})));
///   dds::domain::DomainParticipant participant(domain);
///   dds::topic::Topic<demo_Ping> topic(participant, "ping");               // after DDS_TOPIC_TYPE(demo_Ping);
///   dds::sub::DataReader<demo_Ping> reader(dds::sub::Subscriber(participant), topic);
///   for (const auto& sample : reader.take()) use(sample.data());

#include "dds/cond.hpp"
#include "dds/configuration.hpp"
#include "dds/domain.hpp"
#include "dds/log.hpp"
#include "dds/pub.hpp"
#include "dds/sub.hpp"
