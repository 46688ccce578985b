#include "orchestrator/report/tested.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <pugixml.hpp>
#include <sstream>

namespace consort {
namespace {

// How many bytes the character at the beginning of `text` has, if XML 1.0 allows it; else 0.
std::size_t allowed_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80U) return byte(0) >= 0x20U || text[0] == '\t' || text[0] == '\n' || text[0] == '\r' ? 1 : 0;
  const std::size_t length = byte(0) >= 0xF0U ? 4 : byte(0) >= 0xE0U ? 3 : 2;
  if (byte(0) < 0xC2U || byte(0) > 0xF4U || length > text.size()) return 0;
  std::uint32_t code = byte(0) & (0xFFU >> (length + 1));
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xC0U) != 0x80U) return 0;
    code = (code << 6U) | (byte(i) & 0x3FU);
  }
  const bool shortest = code >= (length == 2 ? 0x80U : length == 3 ? 0x800U : 0x10000U);
  const bool character = code <= 0x10FFFFU && (code < 0xD800U || code > 0xDFFFU) && code != 0xFFFEU && code != 0xFFFFU;
  return shortest && character ? length : 0;
}

void set(pugi::xml_node node, const char* name, std::string_view value) { node.append_attribute(name).set_value(xml_text(value).c_str()); }
void set(pugi::xml_node node, const char* name, std::size_t value) { node.append_attribute(name).set_value(std::to_string(value).c_str()); }
void set(pugi::xml_node node, const char* name, double seconds) {
  node.append_attribute(name).set_value(fmt::format("{:.3f}", seconds).c_str());
}

void put_text(pugi::xml_node node, const char* name, const std::string& text) {
  if (!text.empty()) node.append_child(name).text().set(xml_text(text).c_str());
}

void put_case(pugi::xml_node suite, const TestedExperiment& tested, const TestCase& test) {
  pugi::xml_node node = suite.append_child("testcase");
  set(node, "classname", tested.name);
  set(node, "name", test.name);
  set(node, "time", test.seconds);
  const char* element = test.outcome == TestCase::Outcome::failed    ? "failure"
                        : test.outcome == TestCase::Outcome::error   ? "error"
                        : test.outcome == TestCase::Outcome::skipped ? "skipped"
                                                                     : nullptr;
  if (element != nullptr) {
    pugi::xml_node why = node.append_child(element);
    set(why, "message", test.message);
    if (test.outcome == TestCase::Outcome::error) why.text().set(xml_text(tested.err).c_str());
  }
  put_text(node, "system-out", tested.out);
}

void put_counts(pugi::xml_node node, std::span<const TestedExperiment> all) {
  std::size_t tests = 0, failures = 0, errors = 0, skipped = 0;
  double seconds = 0.0;
  for (const TestedExperiment& tested : all) {
    tests += tested.cases.size();
    failures += tested.count(TestCase::Outcome::failed);
    errors += tested.count(TestCase::Outcome::error);
    skipped += tested.count(TestCase::Outcome::skipped);
    seconds += tested.seconds();
  }
  set(node, "tests", tests);
  set(node, "failures", failures);
  set(node, "errors", errors);
  set(node, "skipped", skipped);
  set(node, "time", seconds);
}

}  // namespace

std::string xml_text(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const std::size_t length = allowed_character(text);
    if (length == 0)
      out += "\uFFFD";
    else
      out += text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string junit(std::span<const TestedExperiment> all) {
  pugi::xml_document document;
  pugi::xml_node suites = document.append_child("testsuites");
  set(suites, "name", "consort");
  put_counts(suites, all);
  for (const TestedExperiment& tested : all) {
    pugi::xml_node suite = suites.append_child("testsuite");
    set(suite, "name", tested.name);
    put_counts(suite, {&tested, 1});
    set(suite, "timestamp", tested.began);
    for (const TestCase& test : tested.cases) put_case(suite, tested, test);
    put_text(suite, "system-err", tested.err);
  }
  std::ostringstream out;
  document.save(out, "  ");
  return out.str();
}

}  // namespace consort
