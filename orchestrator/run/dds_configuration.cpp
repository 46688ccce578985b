#include "orchestrator/run/dds_configuration.hpp"

#include "core/errors.hpp"
#include "idl/dds_failure.hpp"
#include "idl/dds_log.hpp"
#include "orchestrator/script/input_file.hpp"

#include <dds/dds.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <optional>
#include <regex>
#include <string_view>

namespace consort {
namespace {

constexpr std::size_t kLargest = std::size_t{1} << 20;  // bytes of a configuration

// The next of what stands between commas; XML ends where a comma follows a tag.
std::string_view next_part(std::string_view& rest) {
  std::size_t end = rest.find(',');
  if (rest.starts_with('<'))
    while (end != std::string_view::npos && rest[end - 1] != '>') end = rest.find(',', end + 1);
  const std::string_view part = rest.substr(0, end);
  rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  return part;
}

std::string_view trimmed(std::string_view text) {
  const auto space = [](char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; };
  while (!text.empty() && space(text.front())) text.remove_prefix(1);
  while (!text.empty() && space(text.back())) text.remove_suffix(1);
  return text;
}

// What stands in the first group of every match.
std::vector<std::string> every(const std::string& text, const char* expression) {
  const std::regex pattern(expression, std::regex::icase);
  std::vector<std::string> out;
  for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) out.push_back((*it)[1]);
  return out;
}

void examine(const std::string& xml, const std::vector<NetworkInterface>& there, ConfigurationFaults& faults) {
  const std::string text = std::regex_replace(xml, std::regex("<!--[^]*?-->"), "");
  for (const std::string& value : every(text, "<AllowMulticast>\\s*([^<\\s]*)")) faults.no_multicast = value == "false" || value == "none";
  for (const std::string& tag : every(text, "(<NetworkInterface\\s[^>]*>)")) {
    if (!every(tag, "(multicast\\s*=\\s*[\"']false)").empty()) faults.no_multicast = true;
    if (!every(tag, "(presence_required\\s*=\\s*[\"']false)").empty()) continue;
    for (const std::string& name : every(tag, "\\s(?:name|address)\\s*=\\s*[\"']([^\"'$]+)[\"']"))
      if (const std::string refusal = interface_refusal(name, there); !refusal.empty()) faults.refusals.push_back(refusal);
  }
  for (const std::string& name : every(text, "<NetworkInterfaceAddress>\\s*([^<\\s$]+)"))
    if (const std::string refusal = interface_refusal(name, there); name != "auto" && !refusal.empty()) faults.refusals.push_back(refusal);
}

void open_domain(const std::string& configuration) {
  wire::DdsLog::of_this_process().take_reasons();  // of what was before
  const dds::domain::Domain domain(0, configuration);
  const dds::domain::DomainParticipant participant(domain);
}

bool opens(const std::string& configuration) {
  try {
    open_domain(configuration);
    return true;
  } catch (const dds::core::Exception&) {
    return false;
  }
}

}  // namespace

void try_domain(const std::string& interface) {
  dds::configuration::Settings settings;
  settings.interface = interface;
  const std::string own = dds::configuration::xml(settings);
  try {
    open_domain(dds::domain::with_user_configuration(own));
  } catch (const dds::core::Exception& failure) {
    const bool users = !configuration_of_environment().empty();
    try {
      wire::raise_no_domain(failure, "DDS", "end what takes it");
    } catch (const RunError& reason) {
      if (users && opens(own))
        throw ConfigError(fmt::format("CYCLONEDDS_URI: found a configuration with which no domain opens ({})", reason.what()));
      throw;
    }
  }
}

std::string configuration_of_environment() {
  const char* uri = std::getenv("CYCLONEDDS_URI");
  return uri == nullptr ? "" : uri;
}

ConfigurationFaults configuration_faults(const std::string& uri, const std::vector<NetworkInterface>& there) {
  ConfigurationFaults faults;
  for (std::string_view rest = trimmed(uri); !rest.empty(); rest = trimmed(rest)) {
    std::string part(trimmed(next_part(rest)));
    if (part.empty()) continue;
    if (part.front() == '<') {
      examine(part, there, faults);
      continue;
    }
    if (part.starts_with("file://")) part.erase(0, 7);
    try {
      examine(read_input(part, kLargest), there, faults);
    } catch (const ConfigError& error) {
      faults.refusals.push_back(fmt::format("found '{}', which {} with DDS configuration", part, error.what()));
    }
  }
  return faults;
}

}  // namespace consort
