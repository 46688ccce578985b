#include "orchestrator/report/tables.hpp"
#include "orchestrator/report/export.hpp"
#include "orchestrator/report/graphml.hpp"
#include "orchestrator/report/record_schema.hpp"
#include "tests/orchestrator/folder.hpp"
#include "tests/support/text_of.hpp"

#include <gtest/gtest.h>
#include <matio.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <pugixml.hpp>

namespace consort {
namespace {

/// The record of a run of two agents with two numbers each; agent 2 leaves before round 1.
class Tables : public testing::Test {
 protected:
  Tables() {
    Database database(folder_.path() / "record.sqlite", Database::Open::create);
    database.run(record_schema(0.5));
    database.run(
        "INSERT INTO experiment (format, program, name, description, text, mode, seed, runs, agents, rounds, dt, report_every, began) "
        "VALUES "
        "(2, '', 'ring', 'commas, \"quotes\"', '', 'simulate', '18446744073709551615', 1, 2, 1, 0.5, 1, '');"
        "INSERT INTO runs (run, protocol, seed, agents, began, run_hash) VALUES (0, 'local_voting', '18446744073709551615', 2, '', "
        "'0000000000000042');"
        "ALTER TABLE estimates ADD COLUMN x_0 REAL; ALTER TABLE estimates ADD COLUMN x_1 REAL;"
        "INSERT INTO estimates (run, round, agent, x_0, x_1) VALUES (0, 0, 1, 0.1, 2), (0, 0, 2, 1e-300, -3), (0, 1, 1, 0.5, 2.5), "
        "(0, 1, 2, NULL, NULL);"
        "INSERT INTO columns VALUES ('local_voting', 'x_0', 'estimate', 'x', 0, 0, ''), ('local_voting', 'x_1', 'estimate', 'x', 1, 0, '');"
        "INSERT INTO segments VALUES (0, 0, 0, 0), (0, 1, 1, 1); INSERT INTO edges VALUES (0, 1, 2, 0.25), (0, 2, 1, 1);");
  }
  ScratchFolder folder_;
};

TEST_F(Tables, LongHasARowPerNumberAndNoneForWhoIsAbsent) {
  const Exported exported = export_record(folder_.path(), ExportFormat::csv, ExportShape::tall);
  ASSERT_EQ(exported.tables.size(), 1U);
  EXPECT_EQ(exported.tables[0].rows, 6U);
  EXPECT_EQ(text_of(folder_.path() / "csv/long.csv"),
            "run,protocol,seed,round,time,agent,component,value\n"
            "0,local_voting,18446744073709551615,0,0,1,x_0,0.1\n0,local_voting,18446744073709551615,0,0,1,x_1,2\n"
            "0,local_voting,18446744073709551615,0,0,2,x_0,1e-300\n0,local_voting,18446744073709551615,0,0,2,x_1,-3\n"
            "0,local_voting,18446744073709551615,1,0.5,1,x_0,0.5\n0,local_voting,18446744073709551615,1,0.5,1,x_1,2.5\n");
}

TEST_F(Tables, WideHasAColumnPerAgentAndComponent) {
  export_record(folder_.path(), ExportFormat::csv, ExportShape::wide);
  EXPECT_EQ(text_of(folder_.path() / "csv/wide_0.csv"),
            "round,time,agent1_x_0,agent2_x_0,agent1_x_1,agent2_x_1\n0,0,0.1,1e-300,2,-3\n1,0.5,0.5,,2.5,\n");
}

TEST_F(Tables, AsJsonKeepTextsNumbersAndWhatIsNotThere) {
  export_record(folder_.path(), ExportFormat::json);
  const auto experiment = nlohmann::json::parse(text_of(folder_.path() / "json/experiment.json"));
  const auto column = std::find(experiment["columns"].begin(), experiment["columns"].end(), "description") - experiment["columns"].begin();
  EXPECT_EQ(experiment["data"][0][column], "commas, \"quotes\"");
  const auto runs = nlohmann::json::parse(text_of(folder_.path() / "json/runs.json"));
  EXPECT_EQ(runs["data"][0].back(), "0000000000000042") << "a hash is a text, also of digits alone";
  EXPECT_TRUE(runs["data"][0][2].is_null()) << "no sweep";
  EXPECT_EQ(nlohmann::json::parse(text_of(folder_.path() / "json/network.json"))["data"].size(), 0U);
}

TEST_F(Tables, AsMatlabHasThemAreStructsOfColumns) {
  export_record(folder_.path(), ExportFormat::mat);
  export_record(folder_.path(), ExportFormat::mat, ExportShape::wide);
  const auto read = [&](const std::string& table, const std::string& field, auto&& use) {
    mat_t* file = Mat_Open((folder_.path() / "mat" / (table + ".mat")).c_str(), MAT_ACC_RDONLY);
    ASSERT_NE(file, nullptr) << table;
    matvar_t* variable = Mat_VarRead(file, table.c_str());
    matvar_t* column = variable == nullptr ? nullptr : Mat_VarGetStructFieldByName(variable, field.c_str(), 0);
    EXPECT_NE(column, nullptr) << table << "." << field;
    if (column != nullptr) use(*column);
    Mat_VarFree(variable);
    Mat_Close(file);
  };
  read("wide_0", "agent2_x_0", [](const matvar_t& column) {
    ASSERT_EQ(column.dims[0], 2U);
    EXPECT_EQ(static_cast<const double*>(column.data)[0], 1e-300);
    EXPECT_TRUE(std::isnan(static_cast<const double*>(column.data)[1]));
  });
  read("runs", "seed", [](const matvar_t& column) {
    ASSERT_EQ(column.class_type, MAT_C_CELL) << "no double holds it";
    const matvar_t* text = Mat_VarGetCell(const_cast<matvar_t*>(&column), 0);
    EXPECT_EQ(std::string(static_cast<const char*>(text->data), text->nbytes), "18446744073709551615");
  });
  read("network", "sent", [](const matvar_t& column) { EXPECT_EQ(column.dims[0], 0U); });
}

TEST_F(Tables, GraphsAreGraphml) {
  const Exported exported = export_record(folder_.path(), ExportFormat::graphml);
  ASSERT_EQ(exported.tables.size(), 2U);
  pugi::xml_document document;
  ASSERT_TRUE(document.load_file((folder_.path() / "graphml/graph_0.graphml").c_str()));
  const auto graph = document.child("graphml").child("graph");
  EXPECT_STREQ(graph.attribute("edgedefault").value(), "directed");
  EXPECT_STREQ(graph.child("data").text().get(), "run 0: 0-0");
  const auto edge = graph.child("edge");
  EXPECT_STREQ(edge.attribute("source").value(), "1");
  EXPECT_STREQ(edge.attribute("target").value(), "2");
  EXPECT_EQ(edge.child("data").text().as_double(), 0.25);
  ASSERT_TRUE(document.load_file((folder_.path() / "graphml/graph_1.graphml").c_str()));
  EXPECT_TRUE(document.child("graphml").child("graph").child("node")) << "a graph without edges has its agents";
  EXPECT_FALSE(document.child("graphml").child("graph").child("edge"));
}

}  // namespace
}  // namespace consort
