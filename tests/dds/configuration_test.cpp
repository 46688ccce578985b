#include "ping.hpp"

#include <cstdlib>

namespace ping {
namespace {

using dds::configuration::Data;
using dds::configuration::Discovery;
using dds::configuration::Settings;
using dds::configuration::xml;

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Configuration, OfLoopbackMulticastNamesTheInterfaceAndItsMulticast) {
  const std::string text = xml({.tag = "run"});
  EXPECT_TRUE(holds(text, "<Interfaces><NetworkInterface name=\"lo\" multicast=\"true\"/></Interfaces>")) << text;
  EXPECT_TRUE(holds(text, "<AllowMulticast>spdp</AllowMulticast>")) << text;
  EXPECT_TRUE(holds(text, "<Tag>run</Tag>")) << text;
  EXPECT_FALSE(holds(text, "ParticipantIndex")) << text;
  EXPECT_TRUE(holds(text, "<OutputFile>stderr</OutputFile>")) << text;
}

TEST(Configuration, OfDenseRunsSendsDataByMulticast) {
  EXPECT_TRUE(holds(xml({.data = Data::multicast}), "<AllowMulticast>true</AllowMulticast>"));
}

TEST(Configuration, OfNeighboursListsThemAndHasItsOwnPorts) {
  const std::string text =
      xml({.discovery = Discovery::neighbours, .port_base = 10004, .neighbours = {"127.0.0.1:10010", "127.0.0.1:10018"}});
  EXPECT_TRUE(holds(text, "<AllowMulticast>false</AllowMulticast>")) << text;
  EXPECT_TRUE(holds(text, "<ParticipantIndex>0</ParticipantIndex><Peers>")) << text;
  EXPECT_TRUE(holds(text, "<Ports><Base>10004</Base><DomainGain>0</DomainGain></Ports>")) << text;
  EXPECT_TRUE(holds(text, "<Peers><Peer Address=\"127.0.0.1:10010\"/><Peer Address=\"127.0.0.1:10018\"/></Peers>")) << text;
  EXPECT_EQ(dds::configuration::unicast_port(10004), 10014u);
}

TEST(Configuration, TakesAnAddressForAnInterface) {
  EXPECT_TRUE(holds(xml({.interface = "127.0.0.1"}), "<NetworkInterface address=\"127.0.0.1\" multicast=\"true\"/>"));
}

TEST(Configuration, EscapesWhatTheUserNames) { EXPECT_TRUE(holds(xml({.tag = "a<b>&\"c\""}), "<Tag>a&lt;b&gt;&amp;&quot;c&quot;</Tag>")); }

TEST(Configuration, OfTheUserComesLast) {
  EXPECT_EQ(dds::domain::with_user_configuration("<a/>", nullptr), "<a/>");
  EXPECT_EQ(dds::domain::with_user_configuration("<a/>", ""), "<a/>");
  EXPECT_EQ(dds::domain::with_user_configuration("<a/>", "<b/>"), "<a/>,<b/>");
  EXPECT_EQ(dds::domain::with_user_configuration("", "file:///x.xml"), "file:///x.xml");
}

/// Two participants, each behind `first` and `second`, that find each other or do not.
bool meet(const std::string& first, const std::string& second) {
  Side here(1, first), there(2, second);
  dds::topic::Topic<ping_Ball> out(here.participant, "meet"), in(there.participant, "meet");
  dds::pub::DataWriter<ping_Ball> writer(dds::pub::Publisher(here.participant), out);
  dds::sub::DataReader<ping_Ball> reader(dds::sub::Subscriber(there.participant), in);
  return matches(writer, 1) && matches(reader, 1);
}

std::string on_wire(const Settings& settings) {
  Settings here = settings;
  here.external_domain = wire_domain();
  return xml(here);
}

TEST(Configuration, WithEverySettingIsAcceptedByTheLibrary) {
  const Settings all{.data = Data::multicast,
                     .tag = tag(),
                     .spdp_interval = 500ms,
                     .lease_duration = 3000ms,
                     .tuned = true,
                     .writer_linger = 0ms,
                     .writer_high_watermark = 1000000};
  const std::string text = on_wire(all);
  EXPECT_TRUE(holds(text, "<SPDPInterval>500ms</SPDPInterval><LeaseDuration>3000ms</LeaseDuration>")) << text;
  EXPECT_TRUE(holds(text, "<WriterLingerDuration>0ms</WriterLingerDuration>")) << text;
  EXPECT_TRUE(holds(
      text, "<Watermarks><WhcHigh>1000000B</WhcHigh><WhcHighInit>1000000B</WhcHighInit><WhcAdaptive>false</WhcAdaptive></Watermarks>"))
      << text;
  EXPECT_TRUE(meet(text, text));
}

TEST(Configuration, OfWhoeverDoesNotHearMulticastDataMeetsThoseWhoDo) {
  const Settings ordinary{.data = Data::multicast, .tag = tag()};
  Settings apart = ordinary;
  apart.hears_multicast_data = false;
  EXPECT_FALSE(holds(xml(ordinary), "MulticastDataOffset")) << xml(ordinary);
  EXPECT_TRUE(holds(xml(apart), "<Ports><MulticastDataOffset>3</MulticastDataOffset></Ports>")) << xml(apart);
  EXPECT_TRUE(meet(on_wire(ordinary), on_wire(apart)));
}

TEST(Configuration, PortsOfItsOwnKeepThoseOfADomainApartThatAreNotToMeet) {
  const auto base = static_cast<std::uint16_t>(20000 + getpid() % 1000 * 8);
  Settings settings;
  settings.tag = tag();
  settings.external_domain = 200;  // whose own ports would lie above all others
  settings.spdp_interval = std::chrono::milliseconds(200);
  const std::string of_the_domain = xml(settings);
  settings.port_base = base;
  const std::string own = xml(settings);
  settings.hears_multicast_data = false;
  EXPECT_TRUE(meet(own, xml(settings)));
  Side here(1, own), there(2, of_the_domain), with_here(3, own), with_there(4, of_the_domain);
  dds::topic::Topic<ping_Ball> out(here.participant, "meet"), in(there.participant, "meet"), near(with_here.participant, "meet"),
      far(with_there.participant, "meet");
  dds::pub::DataWriter<ping_Ball> writer(dds::pub::Publisher(here.participant), out);
  dds::sub::DataReader<ping_Ball> reader(dds::sub::Subscriber(there.participant), in);
  dds::sub::DataReader<ping_Ball> near_reader(dds::sub::Subscriber(with_here.participant), near);
  dds::pub::DataWriter<ping_Ball> far_writer(dds::pub::Publisher(with_there.participant), far);
  EXPECT_TRUE(matches(near_reader, 1));
  EXPECT_TRUE(matches(writer, 1));
  EXPECT_TRUE(matches(reader, 1));
  EXPECT_EQ(writer.publication_matched_status().current_count(), 1) << "the one with the same ports";
  EXPECT_EQ(reader.subscription_matched_status().current_count(), 1) << "the one in the domain";
}

TEST(Configuration, OfNeighboursIsEnoughOnOneSide) {
  const unsigned base = 12000 + static_cast<unsigned>(getpid() % 1000) * 8;
  const auto side = [&](unsigned offset, std::vector<std::string> neighbours) {
    return xml({.discovery = Discovery::neighbours,
                .tag = tag(),
                .port_base = static_cast<std::uint16_t>(base + offset),
                .neighbours = std::move(neighbours)}) +
           ",<Discovery><ExternalDomainId>200</ExternalDomainId></Discovery>";
  };
  EXPECT_TRUE(meet(side(0, {}), side(4, {"127.0.0.1:" + std::to_string(dds::configuration::unicast_port(base))})));
}

TEST(Configuration, OfTheUserOverridesOurs) {
  // Ours alone keeps the two apart by their tags; the user's fragment gives both the same tag.
  const std::string user = "<Discovery><Tag>" + tag() + "</Tag></Discovery>";
  EXPECT_TRUE(meet(dds::domain::with_user_configuration(configuration("one"), user.c_str()),
                   dds::domain::with_user_configuration(configuration("two"), user.c_str())));
}

TEST(Configuration, ThatCannotBeUsedIsAnError) {
  EXPECT_THROW(Side(1, "<CycloneDDS><Domain><General><NoSuchElement>1</NoSuchElement></General></Domain></CycloneDDS>"),
               dds::core::Exception);
}

}  // namespace
}  // namespace ping
