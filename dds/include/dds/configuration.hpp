#pragma once
/// Cyclone configuration as text. Pure functions; what works on loopback and why is measured, see docs/decisions.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dds::configuration {

/// How processes find each other.
enum class Discovery {
  multicast,   ///< everybody finds everybody; cost grows with the square of the processes, fine up to about 50 on one host
  neighbours,  ///< unicast to the listed addresses only; needs `port_base`; cost grows with the links
};

/// How samples travel. Neighbours discovery has unicast only.
enum class Data {
  unicast,    ///< one packet per reader: right when each sample has few readers
  multicast,  ///< one packet for all: right when most processes read each sample, and only then, as every process on the host wakes for
              ///< each
};

struct Settings {
  std::string interface = "lo";  ///< name, or an IPv4 address of it
  Discovery discovery = Discovery::multicast;
  Data data = Data::unicast;
  bool hears_multicast_data = true;  ///< multicast: else this process has a port of its own for it, and is not woken by what others tell
                                     ///< each other
  std::string tag{};                 ///< processes with different tags never match
  std::optional<std::uint16_t>
      port_base{};  ///< where the ports begin, whatever the domain. neighbours: this process's own, see
                    ///< unicast_port; multicast: common to those that are to meet (4 ports), instead of the domain's
  std::optional<unsigned> external_domain{};                  ///< the domain on the network, where it is not the number within the process
  std::vector<std::string> neighbours{};                      ///< neighbours: "127.0.0.1:PORT" each; listing on one side is enough
  std::optional<std::chrono::milliseconds> spdp_interval{};   ///< how often a participant announces itself; Cyclone: 30 s
  std::optional<std::chrono::milliseconds> lease_duration{};  ///< silence after which a participant is gone; Cyclone: 10 s
  bool tuned = false;          ///< slower acknowledgements and heartbeats: halves a dense start-up of ~100 processes, and
                               ///< adds 1 s to a small one and delays repair of real losses
  double transmit_loss = 0.0;  ///< this share of all outgoing packets, discovery's too, is thrown away at random before the socket
  std::optional<std::chrono::milliseconds> writer_linger{};  ///< how long a writer that ends waits for acknowledgements; Cyclone: 1 s.
                                                             ///< Of a reader that died without a word they never come
  std::optional<std::size_t> writer_high_watermark{};  ///< bytes a writer may hold unacknowledged before a write waits; Cyclone: 500 kB
};

/// For lease_duration where a death is noticed by other means: whoever is silent for a while, stopped or on an overloaded host, is still
/// there. What others were to tell somebody whose lease has run out is lost. Cyclone allows no longer one.
constexpr std::chrono::milliseconds kLongestLease = std::chrono::hours(1);

/// For spdp_interval where packets are lost: whoever is not heard of when it appears is heard of a moment later.
constexpr std::chrono::milliseconds kAnnounceAgain{1000};

/// Ports a process in neighbours mode uses: this one for discovery and the next one for data. Keep bases 4 apart and results under 32768,
/// where the kernel's own port numbers begin.
constexpr unsigned unicast_port(unsigned port_base) { return port_base + 10; }

/// Text as XML content.
inline std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

namespace detail {

inline std::string element(std::string_view name, std::string_view content) {
  std::string result;
  result.append("<").append(name).append(">").append(content).append("</").append(name).append(">");
  return result;
}

inline std::string milliseconds(std::chrono::milliseconds length) { return std::to_string(length.count()) + "ms"; }

/// An interface is named, or given by address when it starts with a digit. `lo` carries no multicast flag, hence the attribute.
inline std::string general(const Settings& settings) {
  const bool address = !settings.interface.empty() && settings.interface.front() >= '0' && settings.interface.front() <= '9';
  const std::string interface =
      std::string("<NetworkInterface ") + (address ? "address" : "name") + "=\"" + escaped(settings.interface) + "\" multicast=\"true\"/>";
  const bool neighbours = settings.discovery == Discovery::neighbours;
  const char* multicast = neighbours ? "false" : settings.data == Data::multicast ? "true" : "spdp";
  return element("General", element("Interfaces", interface) + element("AllowMulticast", multicast));
}

inline std::string discovery(const Settings& settings) {
  std::string content;
  if (!settings.tag.empty()) content += element("Tag", escaped(settings.tag));
  if (settings.external_domain) content += element("ExternalDomainId", std::to_string(*settings.external_domain));
  std::string ports;
  if (settings.port_base) ports += element("Base", std::to_string(*settings.port_base)) + element("DomainGain", "0");
  if (!settings.hears_multicast_data) ports += element("MulticastDataOffset", "3");  // 0-2 and 10 on are in use
  if (!ports.empty()) content += element("Ports", ports);
  if (settings.discovery == Discovery::neighbours) {
    content += element("ParticipantIndex", "0");
    std::string listed;
    for (const std::string& neighbour : settings.neighbours) listed += "<Peer Address=\"" + escaped(neighbour) + "\"/>";
    if (!listed.empty()) content += element("Peers", listed);
  }
  if (settings.spdp_interval) content += element("SPDPInterval", milliseconds(*settings.spdp_interval));
  if (settings.lease_duration) content += element("LeaseDuration", milliseconds(*settings.lease_duration));
  return content.empty() ? "" : element("Discovery", content);
}

inline std::string internal(const Settings& settings) {
  std::string content;
  if (settings.tuned) {
    content +=
        "<SocketReceiveBufferSize max=\"4MB\"/><DeliveryQueueMaxSamples>16384</DeliveryQueueMaxSamples>"
        "<PreEmptiveAckDelay>1s</PreEmptiveAckDelay><AckDelay>200ms</AckDelay><NackDelay>500ms</NackDelay>"
        "<HeartbeatInterval min=\"200ms\" minsched=\"1s\" max=\"8s\">1s</HeartbeatInterval>";
  }
  if (settings.writer_linger) content += element("WriterLingerDuration", milliseconds(*settings.writer_linger));
  if (settings.writer_high_watermark) {
    // The mark starts at its own, low, initial value and adapts, unless told otherwise.
    const std::string bytes = std::to_string(*settings.writer_high_watermark) + "B";
    content += element("Watermarks", element("WhcHigh", bytes) + element("WhcHighInit", bytes) + element("WhcAdaptive", "false"));
  }
  if (settings.transmit_loss > 0.0)
    content += element("Test", element("XmitLossiness", std::to_string(std::lround(1000.0 * settings.transmit_loss))));
  return content.empty() ? "" : element("Internal", content);
}

}  // namespace detail

/// One XML fragment for dds::domain::Domain. Cyclone's warnings and errors go to stderr: its return codes alone say too little.
inline std::string xml(const Settings& settings) {
  return "<CycloneDDS><Domain Id=\"any\">" + detail::general(settings) + detail::discovery(settings) + detail::internal(settings) +
         "<Tracing><Category>warning,error</Category><OutputFile>stderr</OutputFile></Tracing></Domain></CycloneDDS>";
}

}  // namespace dds::configuration
