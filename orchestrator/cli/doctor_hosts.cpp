// The doctor's visit to other hosts.

#include "core/errors.hpp"
#include "idl/card.hpp"
#include "orchestrator/cli/doctor.hpp"
#include "orchestrator/run/commands.hpp"
#include "orchestrator/run/connections.hpp"
#include "orchestrator/run/host_addresses.hpp"
#include "orchestrator/run/lending.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

namespace consort {
namespace {

// s, by the exchange of timestamps with the least delay of several: how far its clock is ahead of this one, and how sure that is.
struct Offset {
  double ahead = 0.0, within = std::numeric_limits<double>::infinity();
};
Offset offset_of(Connection& connection) {
  constexpr int kExchanges = 8;
  const auto now = [] { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); };
  Offset best;
  for (int k = 0; k < kExchanges; ++k) {
    const double asked = now();
    const double there = nlohmann::json::parse(connection.ask(R"({"clock": 0})", "time")).value("time", 0.0);
    const double answered = now(), within = 0.5 * (answered - asked);
    if (within < best.within) best = {there - 0.5 * (asked + answered), within};
  }
  return best;
}

std::vector<DoctorCheck> examine(const Host& host, Connection& connection) {
  Lent lent;
  try {
    lent = connection.lent();
  } catch (const RunError& failure) {
    return {{"connection", false, failure.what(), shell_line(connection_to(host))}};
  }
  std::vector<DoctorCheck> checks{{"connection", true, fmt::format("{} answers as {}", connection_to(host).front(), lent.host), ""}};
  const wire::Build own = wire::Build::own(), theirs = wire::Build::from_word(lent.build);
  const bool same = theirs.fits(own);
  checks.push_back({"build", same, theirs.text() + (same ? "" : ", this one " + own.text()), same ? "" : "install the same build on both"});
  if (!same) return checks;
  const std::string arithmetic = arithmetic_of_this_host();
  const bool alike = lent.arithmetic == arithmetic;
  checks.push_back({"arithmetic", alike, lent.arithmetic + (alike ? "" : ", this one " + arithmetic),
                    alike ? "" : "take hosts alike, or expect other last bits"});
  const Offset offset = offset_of(connection);
  constexpr double kTogether = 0.01;  // s
  const bool together = std::abs(offset.ahead) - offset.within < kTogether;
  checks.push_back({"clock", together, fmt::format("{:+.2f} ms against this host, ± {:.2f} ms", 1e3 * offset.ahead, 1e3 * offset.within),
                    together ? "" : "apt-get install chrony, on both"});
  try {
    const std::string address = connection.use(host.interface.empty() ? numeric_address(host) : host.interface, {});
    checks.push_back({"address", true, address + ", where the others of a run find it", ""});
    const std::string order = nlohmann::json{{"examine", address}}.dump();
    const auto examined = nlohmann::json::parse(connection.ask(order, "examined"));
    for (const auto& check : examined.at("examined"))
      checks.push_back({check.value("name", ""), check.value("well", false), check.value("found", ""), check.value("remedy", "")});
  } catch (const std::runtime_error& failure) {
    checks.push_back({"address", false, failure.what(), "name it in the list: `interface: ADDRESS`"});
  }
  return checks;
}

}  // namespace

std::vector<std::pair<std::string, std::vector<DoctorCheck>>> examine_over_connections(const std::vector<Host>& hosts) {
  std::vector<std::unique_ptr<Connection>> connections(hosts.size());
  for (std::size_t h = 0; h < hosts.size(); ++h)
    if (is_connected(hosts[h].launcher)) connections[h] = std::make_unique<Connection>(hosts[h].name, connection_to(hosts[h]), "");
  std::vector<std::pair<std::string, std::vector<DoctorCheck>>> found;
  for (std::size_t h = 0; h < hosts.size(); ++h) {
    const Host& host = hosts[h];
    if (connections[h])
      found.emplace_back(host.name, examine(host, *connections[h]));
    else if (host.launcher == Launcher::local)
      found.emplace_back(host.name, examine_host(host.interface.empty() ? "lo" : host.interface));
    else
      found.emplace_back(host.name, std::vector<DoctorCheck>{{"connection", true, "none: started by hand; `consort doctor` there", ""}});
  }
  return found;
}

}  // namespace consort
