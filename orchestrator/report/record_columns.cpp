#include "orchestrator/report/record_columns.hpp"

#include "protocols/registry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <span>
#include <utility>

namespace consort {
namespace {

std::string meaning_in(std::span<const ValueDoc> docs, const std::string& field) {
  const auto doc = std::find_if(docs.begin(), docs.end(), [&](const ValueDoc& each) { return each.name == field; });
  return doc == docs.end() ? field : std::string(doc->meaning);
}

// One column per number of the layout, usable in SQL without quotes: x; x_0, x_1, ...; P_0_0, P_1_0, ... (column-major).
template <class Meaning>
void add_columns_of(const Layout& layout, const std::string& kind, const std::string& prefix, Meaning&& meaning,
                    std::vector<RecordColumn>& out) {
  for (const Field& field : layout.fields) {
    const std::string name = prefix + field.name, text = meaning(field.name);
    for (std::size_t column = 0; column < field.cols; ++column) {
      for (std::size_t row = 0; row < field.rows; ++row) {
        std::string numbered = name;
        if (field.size() > 1) numbered += fmt::format("_{}", row);
        if (field.cols > 1) numbered += fmt::format("_{}", column);
        out.push_back({std::move(numbered), kind, field, row, column, text});
      }
    }
  }
}

}  // namespace

std::vector<RecordColumn> columns_of(const ProtocolChoice& choice, const Experiment& experiment, const Trace& outline) {
  const auto table = protocol_table();
  const auto entry = std::find_if(table.begin(), table.end(), [&](const ProtocolEntry& each) { return each.name == choice.name; });
  const auto docs = [&](auto docs_of) { return entry == table.end() ? std::span<const ValueDoc>() : (*entry).*docs_of; };
  std::vector<RecordColumn> columns;
  add_columns_of(
      outline.estimate_layout, "estimate", "", [&](const auto& field) { return meaning_in(docs(&ProtocolEntry::estimate), field); },
      columns);
  add_columns_of(
      outline.recorded_layout, "state", "", [&](const auto& field) { return meaning_in(docs(&ProtocolEntry::recorded), field); }, columns);
  const std::string plant = experiment.plant ? experiment.plant->model : "";
  add_columns_of(
      outline.state_layout, "plant", "plant_",
      [&](const auto& field) { return fmt::format("{}, true state of the agent's part of the plant {}", field, plant); }, columns);
  return columns;
}

}  // namespace consort
