#include "orchestrator/report/study_table.hpp"
#include "orchestrator/report/terminal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace consort {
namespace {

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c);
  return out + "\"";
}

// Shortest text that reads back as the same number; nothing where there is none.
std::string exact(double value) { return std::isnan(value) ? "" : fmt::format("{}", value); }

std::string last_of(const std::string& key) { return key.substr(key.rfind('.') + 1); }

bool several_runs(const StudyPlan& plan) {
  return std::any_of(plan.cells.begin(), plan.cells.end(), [](const PlannedCell& cell) { return cell.runs > 1; });
}
bool any_converged(const StudyTable& table) {
  return std::any_of(table.rows.begin(), table.rows.end(), [](const StudyRow& row) { return row.result.converged > 0; });
}

// A mean and half of its confidence interval, to that half's two digits.
std::string with_half(double mean, double half, const char* sign) {
  if (!std::isfinite(half)) return fmt::format("{:.6g}", mean);  // one seed has no interval
  if (half <= 1e-13 * std::abs(mean)) return fmt::format("{:.6g} {} 0", mean, sign);
  const int decimals = std::max(0, 1 - static_cast<int>(std::floor(std::log10(half))));
  if (decimals > 8 || std::abs(mean) >= 1e9) return fmt::format("{:.4g} {} {:.2g}", mean, sign, half);
  return fmt::format("{:.{}f} {} {:.{}f}", mean, decimals, sign, half, decimals);
}

std::string with_interval(const StudyRow& row, const std::string& metric, const char* sign) {
  const auto found = row.spreads.find(metric);
  if (found == row.spreads.end() || std::isnan(found->second.mean)) return "-";
  const Spread& spread = found->second;
  const std::string text = with_half(spread.mean, 0.5 * (spread.high - spread.low), sign);
  return spread.count < row.result.runs ? text + fmt::format(" ({} of {})", spread.count, row.result.runs) : text;
}

// Heads and rows as they are shown: keys, protocol, metrics, share that converged.
std::vector<std::vector<std::string>> shown_cells(const StudyPlan& plan, const StudyTable& table, const char* sign) {
  std::vector<std::vector<std::string>> out(1);
  for (const std::string& key : plan.keys) out[0].push_back(last_of(key));
  out[0].push_back("protocol");
  out[0].insert(out[0].end(), table.metrics.begin(), table.metrics.end());
  const bool converged = any_converged(table);
  if (converged) out[0].push_back("converged");
  for (const StudyRow& row : table.rows) {
    auto& cells = out.emplace_back();
    for (const Setting& setting : plan.cells[row.cell].cell.settings) cells.push_back(text_of(setting));
    cells.push_back(row.protocol);
    for (const std::string& metric : table.metrics) cells.push_back(with_interval(row, metric, sign));
    if (converged) cells.push_back(fmt::format("{} of {}", row.result.converged, row.result.runs));
  }
  return out;
}

std::string tex_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::string_view("_%&#$").find(c) != std::string_view::npos) out += '\\';
    if (std::string_view("\\{}~^").find(c) != std::string_view::npos) continue;
    out += c;
  }
  return out;
}

std::string interval_words(const StudyPlan& plan) {
  return several_runs(plan) ? "mean and 95 % confidence interval (Student's t) over the seeds that have the metric" : "one seed each";
}

}  // namespace

std::string table_csv(const StudyPlan& plan, const StudyTable& table) {
  std::string out = "cell";
  for (const std::string& key : plan.keys) out += "," + csv_field(key);
  out += ",protocol,metric,runs,have_it,share,converged,mean,std,ci95_low,ci95_high,q05,q25,median,q75,q95\n";
  for (const StudyRow& row : table.rows) {
    std::string head = std::to_string(row.cell + 1);
    for (const Setting& setting : plan.cells[row.cell].cell.settings) head += "," + csv_field(text_of(setting));
    const auto runs = static_cast<double>(std::max<std::size_t>(1, row.result.runs));
    for (const auto& [metric, s] : row.spreads) {
      out += fmt::format("{},{},{},{},{},{},{}", head, csv_field(row.protocol), csv_field(metric), row.result.runs, s.count,
                         exact(static_cast<double>(s.count) / runs), exact(static_cast<double>(row.result.converged) / runs));
      for (const double value : {s.mean, s.deviation, s.low, s.high, s.q05, s.q25, s.median, s.q75, s.q95}) out += "," + exact(value);
      out += "\n";
    }
  }
  return out;
}

std::string table_tex(const StudyPlan& plan, const StudyTable& table) {
  const auto cells = shown_cells(plan, table, "$\\pm$");
  std::string out = fmt::format("% {}: {}\n\\begin{{tabular}}{{{}{}}}\n\\toprule\n", plan.experiment, interval_words(plan),
                                std::string(plan.keys.size() + 1, 'l'), std::string(cells[0].size() - plan.keys.size() - 1, 'r'));
  for (std::size_t r = 0; r < cells.size(); ++r) {
    for (std::size_t c = 0; c < cells[r].size(); ++c) {
      const bool number = r > 0 && c > plan.keys.size();
      out += (c > 0 ? " & " : "") + (number ? cells[r][c] : tex_text(cells[r][c]));
    }
    out += r == 0 ? " \\\\\n\\midrule\n" : " \\\\\n";
  }
  return out + "\\bottomrule\n\\end{tabular}\n";
}

std::string table_markdown(const StudyPlan& plan, const StudyTable& table) {
  const auto cells = shown_cells(plan, table, "±");
  std::vector<std::size_t> widths(cells[0].size(), 3);
  for (const auto& row : cells)
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], shown_width(row[c]));
  std::string out;
  for (std::size_t r = 0; r < cells.size(); ++r) {
    for (std::size_t c = 0; c < cells[r].size(); ++c)
      out += "| " + cells[r][c] + std::string(widths[c] - shown_width(cells[r][c]) + 1, ' ');
    out += "|\n";
    if (r > 0) continue;
    for (const std::size_t width : widths) out += "|" + std::string(width + 2, '-');
    out += "|\n";
  }
  return out + "\n" + interval_words(plan) + "\n";
}

}  // namespace consort
