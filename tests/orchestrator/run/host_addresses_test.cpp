/// Under which addresses processes on several hosts find each other. The hosts here are all this one.

#include "orchestrator/run/host_addresses.hpp"

#include "core/errors.hpp"
#include "orchestrator/run/spread.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

Placement on(std::vector<std::size_t> hosts) {
  Placement placement;
  placement.host_of = std::move(hosts);
  return placement;
}

std::string refusal(RunOptions options, const Placement& placement) {
  try {
    find_addresses(options, placement);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(HostAddresses, AreWhereNamesLeadAndThisHostIsFoundOnTheWayToThem) {
  EXPECT_EQ(address_of("localhost"), "127.0.0.1");
  EXPECT_EQ(address_of("nowhere.invalid"), "");
  EXPECT_EQ(address_towards("127.0.0.1"), "127.0.0.1");
  RunOptions options;
  options.hosts = {{.name = "a", .address = "me@localhost"},
                   {.name = "here", .launcher = Launcher::local},
                   {.name = "unused", .address = "nowhere.invalid"}};
  find_addresses(options, on({0, 1, 0}));
  EXPECT_EQ(options.host_addresses, (std::vector<std::string>{"127.0.0.1", "127.0.0.1", ""}));
  EXPECT_EQ(options.interface, "127.0.0.1");
}

TEST(HostAddresses, WhereAllProcessesAreHereThereAreNoHosts) {
  RunOptions options;
  options.hosts = {{.name = "far", .address = "nowhere.invalid"}, {.name = "here", .launcher = Launcher::local}};
  find_addresses(options, on({1, 1, kHere}));
  EXPECT_TRUE(options.hosts.empty());
  EXPECT_EQ(options.interface, "lo");
}

TEST(HostAddresses, ThatNobodyKnowsAreRefusedWithTheRemedy) {
  RunOptions options;
  options.hosts = {{.name = "far", .address = "nowhere.invalid"}};
  EXPECT_NE(refusal(options, on({0})).find("hosts: found address 'nowhere.invalid' of far, which is unknown here"), std::string::npos);
  options.hosts = {{.name = "far", .launcher = Launcher::manual, .interface = "eth7"}};
  EXPECT_NE(refusal(options, on({0})).find("hosts: found interface 'eth7' of far, which is started by hand"), std::string::npos);
  options.hosts = {{.name = "far", .interface = "::1"}};
  EXPECT_NE(refusal(options, on({0})).find("hosts: found ::1 of far; allowed: addresses of IPv4"), std::string::npos);
}

}  // namespace
}  // namespace consort
