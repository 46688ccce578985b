#include "orchestrator/report/comparison.hpp"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace consort {
namespace {

using Keys = std::map<std::string, std::string>;

void flatten(const YAML::Node& node, const std::string& path, Keys& out) {
  if (node.IsMap()) {
    for (const auto& entry : node) flatten(entry.second, path + (path.empty() ? "" : ".") + entry.first.Scalar(), out);
  } else if (node.IsSequence()) {
    for (std::size_t i = 0; i < node.size(); ++i) flatten(node[i], path + "[" + std::to_string(i) + "]", out);
  } else {
    out[path] = node.IsNull() ? "null" : node.Scalar();
  }
}

Keys keys_of(const nlohmann::ordered_json& object) {
  Keys keys;
  if (!object.is_object()) return keys;
  for (const auto& [key, value] : object.items()) {
    if (value.is_object() || value.is_array()) continue;
    keys[key] = value.is_string() ? value.get<std::string>() : value.dump();
  }
  return keys;
}

std::vector<KeyCompared> compare_keys(const Keys& a, const Keys& b) {
  Keys both = a;
  both.insert(b.begin(), b.end());
  const auto in = [](const Keys& keys, const std::string& key) {
    const auto found = keys.find(key);
    return found == keys.end() ? std::nullopt : std::optional(found->second);
  };
  std::vector<KeyCompared> differ;
  for (const auto& [key, value] : both)
    if (in(a, key) != in(b, key)) differ.push_back({key, in(a, key), in(b, key)});
  return differ;
}

bool within(const std::optional<double>& a, const std::optional<double>& b, double allowed) {
  if (!a || !b) return a.has_value() == b.has_value();
  if (std::isnan(*a) || std::isnan(*b)) return std::isnan(*a) && std::isnan(*b);
  return *a == *b || std::abs(*b - *a) <= allowed;  // infinities are equal, or further apart than anything
}

std::vector<MetricCompared> compare_metrics(const std::map<std::string, double>& a, const std::map<std::string, double>& b,
                                            std::span<const Tolerance> tolerances) {
  std::map<std::string, double> both = a;
  both.insert(b.begin(), b.end());
  std::vector<MetricCompared> compared;
  for (const auto& [name, value] : both) {
    MetricCompared& metric = compared.emplace_back(MetricCompared{name, {}, {}});
    if (const auto found = a.find(name); found != a.end()) metric.a = found->second;
    if (const auto found = b.find(name); found != b.end()) metric.b = found->second;
    metric.allowed = allowed(tolerances, name, value);
    metric.within = within(metric.a, metric.b, metric.allowed);
  }
  return compared;
}

std::string verdict_on(const KeptCriterion& criterion) { return !criterion.met ? "open" : *criterion.met ? "met" : "not met"; }

// Criteria belong together by their texts; of several alike the first to the first.
std::vector<CriterionCompared> flips(const std::vector<KeptCriterion>& a, const std::vector<KeptCriterion>& b) {
  std::vector<CriterionCompared> flipped;
  std::vector<bool> taken(b.size());
  for (const KeptCriterion& left : a) {
    std::size_t at = 0;
    while (at < b.size() && (taken[at] || b[at].text != left.text)) ++at;
    if (at < b.size()) taken[at] = true;
    const std::string other = at < b.size() ? verdict_on(b[at]) : "not there";
    if (verdict_on(left) != other) flipped.push_back({left.text, verdict_on(left), other});
  }
  for (std::size_t at = 0; at < b.size(); ++at)
    if (!taken[at]) flipped.push_back({b[at].text, "not there", verdict_on(b[at])});
  return flipped;
}

}  // namespace

std::vector<KeyCompared> keys_that_differ(const std::string& yaml_a, const std::string& yaml_b) {
  if (yaml_a == yaml_b) return {};
  try {
    Keys a, b;
    flatten(YAML::Load(yaml_a), "", a);
    flatten(YAML::Load(yaml_b), "", b);
    return compare_keys(a, b);
  } catch (const YAML::Exception&) {  // of a record that was written by hand
    return {{"experiment", yaml_a, yaml_b}};
  }
}

RunCompared::Bits judge_bits(const KeptRun& a, const KeptRun& b, const ReportsCompared& reports) {
  using Bits = RunCompared::Bits;
  if (reports.first) return Bits::differ;
  if (a.hash.empty() || b.hash.empty()) return Bits::unended;
  if (a.rounds != b.rounds) return Bits::length;
  return a.hash == b.hash ? Bits::equal : Bits::unreported;
}

std::vector<std::optional<std::size_t>> pair_runs(std::span<const KeptRun> a, std::span<const KeptRun> b) {
  std::map<std::pair<std::string, std::string>, std::size_t> by_seed;
  for (std::size_t i = 0; i < b.size(); ++i) by_seed[{b[i].protocol, b[i].seed}] = i;
  std::vector<std::optional<std::size_t>> pairs(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto found = by_seed.find({a[i].protocol, a[i].seed});
    if (found == by_seed.end()) continue;
    pairs[i] = found->second;
    by_seed.erase(found);
  }
  std::map<std::string, std::vector<std::size_t>> left;  // of each protocol, the last first
  for (std::size_t i = b.size(); i-- > 0;)
    if (by_seed.contains({b[i].protocol, b[i].seed})) left[b[i].protocol].push_back(i);
  for (std::size_t i = 0; i < a.size(); ++i) {
    auto& others = left[a[i].protocol];
    if (pairs[i] || others.empty()) continue;
    pairs[i] = others.back();
    others.pop_back();
  }
  return pairs;
}

bool Comparison::same_bits() const {
  return !runs.empty() &&
         std::all_of(runs.begin(), runs.end(), [](const RunCompared& run) { return run.bits == RunCompared::Bits::equal; });
}

bool Comparison::same_metrics() const {
  return std::all_of(metrics.begin(), metrics.end(), [](const MetricCompared& metric) { return metric.within; });
}

Comparison compare_values(const KeptResults& a, const KeptResults& b, std::span<const Tolerance> tolerances) {
  Comparison comparison;
  comparison.a = a.folder.string();
  comparison.b = b.folder.string();
  comparison.metrics = compare_metrics(a.metrics, b.metrics, tolerances);
  comparison.flipped = flips(a.criteria, b.criteria);
  comparison.file = keys_that_differ(a.text, b.text);
  Keys host_a = keys_of(a.host), host_b = keys_of(b.host);
  for (const char* of_the_run : {"began", "seed"}) {
    host_a.erase(of_the_run);
    host_b.erase(of_the_run);
  }
  comparison.host = compare_keys(host_a, host_b);
  const auto versions = [](const nlohmann::ordered_json& host) { return host.contains("versions") ? keys_of(host["versions"]) : Keys(); };
  comparison.versions = compare_keys(versions(a.host), versions(b.host));
  comparison.tolerant = !tolerances.empty();
  return comparison;
}

Comparison compare_folders(const std::filesystem::path& a, const std::filesystem::path& b, std::span<const Tolerance> tolerances) {
  const KeptResults left = kept_results(a), right = kept_results(b);
  Comparison comparison = compare_values(left, right, tolerances);
  Database record_a(record_of(a), Database::Open::read), record_b(record_of(b), Database::Open::read);
  const auto pairs = pair_runs(left.runs, right.runs);
  std::vector<bool> taken(right.runs.size());
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const KeptRun& run = left.runs[i];
    RunCompared& compared =
        comparison.runs.emplace_back(RunCompared{run.protocol, run.seed, RunCompared::Bits::only_a, {}, run.rounds, {}});
    if (!pairs[i]) continue;
    const KeptRun& other = right.runs[*pairs[i]];
    taken[*pairs[i]] = true;
    if (other.seed != run.seed) compared.seed += " and " + other.seed;
    compared.reports = compare_reports(record_a, run.run, record_b, other.run, run.protocol);
    compared.rounds_b = other.rounds;
    compared.bits = judge_bits(run, other, compared.reports);
  }
  for (std::size_t i = 0; i < right.runs.size(); ++i)
    if (!taken[i])
      comparison.runs.push_back({right.runs[i].protocol, right.runs[i].seed, RunCompared::Bits::only_b, {}, {}, right.runs[i].rounds});
  return comparison;
}

}  // namespace consort
