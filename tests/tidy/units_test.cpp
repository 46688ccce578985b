/// Which test holds which unit of the product. A unit (a header, a source file, or both) lies in `core/stop`; its test is
/// tests/core/stop_test.cpp, or one that includes its header, or one that stands here.

#include "tests/support/tree.hpp"
#include "tests/tidy/source_tree.hpp"

#include <gtest/gtest.h>

#include <map>
#include <set>

namespace consort::tidy {
namespace {

/// A unit, or the beginning of the names of several; the longest that fits counts.
const std::map<std::string, std::string>& held_elsewhere() {
  static const std::map<std::string, std::string> tests{
      {"agent/", "tests/system/conformance_test.cpp"},
      {"core/counters", "tests/core/network/mailbox_property_test.cpp"},
      {"core/layout", "tests/core/network/mailbox_test.cpp"},
      {"core/math/shapes", "tests/core/math/controllability_test.cpp"},
      {"core/math/spd", "tests/protocols/consensus/far_covariances_test.cpp"},
      {"core/messages", "tests/idl/codec_test.cpp"},
      {"core/metrics/realtime", "tests/system/realtime_test.cpp"},
      {"core/metrics/steering", "tests/papers/steering_test.cpp"},
      {"core/nearest", "tests/orchestrator/script/slips_test.cpp"},
      {"core/number_text", "tests/core/option_text_test.cpp"},
      {"core/plant_task", "tests/models/physics_test.cpp"},
      {"core/value_doc", "tests/protocols/defaults_test.cpp"},
      {"dds/", "tests/dds/exchange_test.cpp"},
      {"idl/refusal", "tests/idl/trust_test.cpp"},
      {"io/interfaces", "tests/orchestrator/cli/doctor_test.cpp"},
      {"models/", "tests/models/physics_test.cpp"},
      {"orchestrator/cli/", "tests/orchestrator/cli/cli_test.cpp"},
      {"orchestrator/cli/completion_scripts", "tests/orchestrator/cli/completion_test.cpp"},
      {"orchestrator/cli/link_schema", "tests/orchestrator/cli/tables_test.cpp"},
      {"orchestrator/cli/cell", "tests/orchestrator/cli/study_test.cpp"},
      {"orchestrator/cli/collect", "tests/orchestrator/cli/study_test.cpp"},
      {"orchestrator/cli/study", "tests/orchestrator/cli/study_test.cpp"},
      {"orchestrator/report/comparison_text", "tests/orchestrator/report/comparison_test.cpp"},
      {"orchestrator/report/csv_tables", "tests/orchestrator/report/tables_test.cpp"},
      {"orchestrator/report/cell_result", "tests/orchestrator/report/cell_store_test.cpp"},
      {"orchestrator/report/curve_over_seeds", "tests/orchestrator/report/cell_store_test.cpp"},
      {"orchestrator/report/deviation_curve", "tests/page/page_test.cpp"},
      {"orchestrator/report/json_tables", "tests/orchestrator/report/tables_test.cpp"},
      {"orchestrator/report/junit", "tests/orchestrator/report/tested_test.cpp"},
      {"orchestrator/report/mat_tables", "tests/orchestrator/report/tables_test.cpp"},
      {"orchestrator/report/page", "tests/page/page_test.cpp"},
      {"orchestrator/report/portrait", "tests/orchestrator/cli/cli_test.cpp"},
      {"orchestrator/report/record", "tests/orchestrator/report/record_test.cpp"},
      {"orchestrator/report/recorded_run", "tests/page/page_test.cpp"},
      {"orchestrator/report/study_", "tests/orchestrator/report/study_table_test.cpp"},
      {"orchestrator/report/summary_json", "tests/orchestrator/report/results_test.cpp"},
      {"orchestrator/report/text_tables", "tests/orchestrator/report/tables_test.cpp"},
      {"orchestrator/report/watch", "tests/page/page_test.cpp"},
      {"orchestrator/run/", "tests/system/conformance_test.cpp"},
      {"orchestrator/run/connections", "tests/hosts/hosts_test.cpp"},
      {"orchestrator/run/dds_configuration", "tests/orchestrator/cli/doctor_test.cpp"},
      {"orchestrator/run/event_teller", "tests/orchestrator/run/simulated_test.cpp"},
      {"orchestrator/run/fleet", "tests/hosts/hosts_test.cpp"},
      {"orchestrator/run/session_members", "tests/system/process_events_test.cpp"},
      {"orchestrator/script/", "tests/orchestrator/script/script_test.cpp"},
      {"orchestrator/script/criterion", "tests/orchestrator/script/criterion_property_test.cpp"},
      {"orchestrator/script/disturbances", "tests/orchestrator/script/plant_test.cpp"},
      {"orchestrator/script/graph_lines", "tests/orchestrator/script/graph_file_test.cpp"},
      {"orchestrator/script/graph_trees", "tests/orchestrator/script/graph_file_test.cpp"},
      {"orchestrator/script/link_reader", "tests/orchestrator/script/links_test.cpp"},
      {"orchestrator/script/lookalikes", "tests/orchestrator/script/slips_test.cpp"},
      {"orchestrator/script/measures", "tests/orchestrator/script/plant_test.cpp"},
      {"orchestrator/script/schema", "tests/orchestrator/script/places_test.cpp"},
      {"orchestrator/script/skeleton", "tests/orchestrator/script/slips_test.cpp"},
      {"orchestrator/script/sweep", "tests/orchestrator/script/links_test.cpp"},
      {"orchestrator/script/swept", "tests/orchestrator/script/study_test.cpp"},
      {"orchestrator/script/trial", "tests/orchestrator/script/places_test.cpp"},
      {"plant/", "tests/system/closed_loop_test.cpp"},
      {"process/run_member_arrival", "tests/process/run_member_test.cpp"},
      {"process/run_process", "tests/system/conformance_test.cpp"},
      {"protocols/", "tests/protocols/adapter_test.cpp"},
      {"protocols/adaptive/", "tests/protocols/adaptive/gain_protocols_test.cpp"},
      {"protocols/consensus/", "tests/protocols/theory_test.cpp"},
      {"protocols/control/", "tests/protocols/control/steering_test.cpp"},
      {"protocols/everybody/", "tests/protocols/everybody/distributed_observer_test.cpp"},
      {"protocols/everybody/sensing_theory", "tests/protocols/everybody/theory_test.cpp"},
      {"protocols/filters/", "tests/protocols/filters/kalman_filters_test.cpp"},
      {"protocols/filters/dlo_", "tests/protocols/filters/luenberger_observers_test.cpp"},
      {"protocols/filters/luenberger_base", "tests/protocols/filters/luenberger_observers_test.cpp"},
      {"protocols/predicted_value", "tests/papers/steering_test.cpp"},
      {"protocols/sensor_network/", "tests/protocols/sensor_network/theory_test.cpp"},
      {"rounds/agent_maker", "tests/rounds/simulate_test.cpp"},
      {"rounds/hosted", "tests/rounds/lockstep_test.cpp"},
      {"rounds/last_round", "tests/orchestrator/run/ending_test.cpp"},
      {"rounds/rounds", "tests/rounds/lockstep_test.cpp"},
  };
  return tests;
}

TEST(Tests, EveryUnitIsHeldByOne) {
  std::set<std::string> units, files, included, used;
  for (const SourceFile& file : source_tree(kSourceDir)) {
    files.insert(file.path);
    if (!file.cpp()) continue;
    if (!file.test()) units.insert(file.path.substr(0, file.path.rfind('.')));
    if (file.test())
      for (const SourceFile::Include& include : file.includes()) included.insert(include.what);
  }
  for (const std::string& unit : units) {
    if (files.contains("tests/" + unit + "_test.cpp") || included.contains(unit + ".hpp")) continue;
    const std::pair<const std::string, std::string>* holder = nullptr;
    for (const auto& entry : held_elsewhere())  // ascending: of two that fit, the longer comes later
      if (unit.starts_with(entry.first)) holder = &entry;
    if (holder == nullptr)
      ADD_FAILURE() << unit << " has no test: tests/" << unit << "_test.cpp, or a line here";
    else
      used.insert(holder->first);
  }
  for (const auto& [unit, test] : held_elsewhere()) {
    EXPECT_TRUE(files.contains(test)) << unit << ": there is no " << test;
    EXPECT_TRUE(used.contains(unit)) << unit << ": a line that nobody needs";
  }
}

}  // namespace
}  // namespace consort::tidy
