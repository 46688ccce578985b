#include "idl/dds_failure.hpp"

#include "idl/card.hpp"

#include <gtest/gtest.h>

namespace consort::wire {
namespace {

TEST(DdsFailure, WhatCycloneObjectsToInAConfigurationIsSaidInOurWords) {
  const std::string version = "Cyclone DDS " + Build::own().cyclone;
  EXPECT_EQ(objection_in("config: //CycloneDDS/Domain: parser error expecting '/>' or '>' () at line 1 (CYCLONEDDS_URI+679 line 1)"),
            "found broken XML in line 1, within CycloneDDS/Domain; allowed: tags that are closed in their order, and attributes in quotes");
  EXPECT_EQ(
      objection_in("config: //CycloneDDS/Domain/General: Foo: unknown element (CYCLONEDDS_URI+263 line 1)"),
      "found the element 'Foo' in CycloneDDS/Domain/General, which " + version + " does not know; allowed: what its manual lists there");
  EXPECT_EQ(
      objection_in("config: //CycloneDDS/Domain/General/AllowMulticast/#text: 'maybe' in 'maybe' undefined (CYCLONEDDS_URI+2 line 1)"),
      "found 'maybe' in CycloneDDS/Domain/General/AllowMulticast; allowed: a value that the manual of " + version + " lists there");
  EXPECT_EQ(
      objection_in("config: //CycloneDDS/Domain/Discovery/Peers: 3: out of range (CYCLONEDDS_URI+2 line 1)"),
      "found '3: out of range' in CycloneDDS/Domain/Discovery/Peers; allowed: a value that the manual of " + version + " lists there");
  EXPECT_EQ(objection_in("failed to increase socket receive buffer size to at least 900 bytes, current is 80 bytes"),
            "found a receive buffer of at least 900 bytes, of which the kernel grants 80; allowed: less, or after `sudo sysctl -w "
            "net.core.rmem_max=900`");
  EXPECT_EQ(objection_in("rtps_init: failed to create unicast sockets for domain 28 participant index 5 (ports 10260, 10261)"), "");
}

TEST(DdsFailure, PortsThatAreTakenAreNamed) {
  EXPECT_EQ(taken_ports_in("rtps_init: failed to create unicast sockets for domain 28 participant index 5 (ports 10260, 10261)"),
            "UDP port 10260 or 10261 is taken by another process");
  EXPECT_EQ(taken_ports_in("config: //CycloneDDS: ports"), "");
}

}  // namespace
}  // namespace consort::wire
