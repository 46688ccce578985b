#pragma once
/// What the page of a study shows: each metric against what is swept, and the table.

#include "orchestrator/report/study_table.hpp"

#include <nlohmann/json.hpp>

#include <filesystem>

namespace consort {

bool is_study_folder(const std::filesystem::path& folder);

/// {axis, metrics: [{name, series: [{name, values}]}], over_rounds, heads, rows}: a value is a mean, or [low, mean, high] over several
/// seeds.
nlohmann::ordered_json page_study(const StudyPlan& plan, const StudyTable& table);

}  // namespace consort
