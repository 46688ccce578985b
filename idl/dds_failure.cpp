#include "idl/dds_failure.hpp"

#include "core/errors.hpp"
#include "idl/card.hpp"
#include "idl/dds_log.hpp"

#include <cstdlib>
#include <regex>

namespace consort::wire {
namespace {

// What stands in the groups of `expression` within `text`; nothing if it does not match.
std::smatch found(const std::string& text, const char* expression) {
  std::smatch match;
  std::regex_search(text, match, std::regex(expression));
  return match;
}

}  // namespace

std::string objection_in(const std::string& reason) {
  const std::string version = "Cyclone DDS " + Build::own().cyclone;
  if (const auto m = found(reason, "config: /*(\\S*): parser error .* at line (\\d+)"); !m.empty())
    return "found broken XML in line " + m[2].str() + ", within " + m[1].str() +
           "; allowed: tags that are closed in their order, and attributes in quotes";
  if (const auto m = found(reason, "config: /*(\\S*): (\\S+): unknown (element|attribute)"); !m.empty())
    return "found the " + m[3].str() + " '" + m[2].str() + "' in " + m[1].str() + ", which " + version +
           " does not know; allowed: what its manual lists there";
  if (const auto m = found(reason, "config: /*(\\S+?)(?:/#text)?: (?:'(.*)' in '.*' undefined|(.*?))(?: \\(\\S+ line \\d+\\))?$");
      !m.empty())
    return "found '" + m[2].str() + m[3].str() + "' in " + m[1].str() + "; allowed: a value that the manual of " + version + " lists there";
  if (const auto m = found(reason, "increase socket (receive|send) buffer size to at least (\\d+) bytes, current is (\\d+)"); !m.empty())
    return "found a " + m[1].str() + " buffer of at least " + m[2].str() + " bytes, of which the kernel grants " + m[3].str() +
           "; allowed: less, or after `sudo sysctl -w net.core." + (m[1] == "receive" ? "r" : "w") + "mem_max=" + m[2].str() + "`";
  return {};
}

std::string taken_ports_in(const std::string& reason) {
  const auto m = found(reason, "failed to create [a-z ]*sockets.*\\(ports (\\d+), (\\d+)\\)");
  return m.empty() ? "" : "UDP port " + m[1].str() + " or " + m[2].str() + " is taken by another process";
}

void raise_no_domain(const dds::core::Exception& failure, const std::string& what, const std::string& remedy) {
  const char* uri = std::getenv("CYCLONEDDS_URI");
  const bool users = uri != nullptr && *uri != '\0';
  std::string all;
  for (const std::string& reason : DdsLog::of_this_process().take_reasons()) {
    if (const std::string objection = objection_in(reason); !objection.empty() && users)
      throw ConfigError("CYCLONEDDS_URI: " + objection + ", or none at all (`unset CYCLONEDDS_URI`)");
    if (const std::string ports = taken_ports_in(reason); !ports.empty())
      throw RunError(what + ": " + ports + "; " + remedy +
                     (users ? "; CYCLONEDDS_URI is set, and may be what asks for them (`unset CYCLONEDDS_URI`)" : ""));
    all += "; " + reason;
  }
  throw RunError(what + ": " + failure.what() + all + "; `consort doctor` looks for the cause");
}

}  // namespace consort::wire
