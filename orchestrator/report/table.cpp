#include "orchestrator/report/table.hpp"

#include "core/counted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace consort {
namespace {

constexpr std::size_t kComponentsShown = 3;
constexpr std::size_t kIndent = 2, kGap = 3;

// Text that is lined up with its column at the end of the leading integer, so that decimal points stand below each other.
struct Cell {
  std::string text;
  std::size_t point = 0;  // characters before the point
};

struct Row {
  std::string label;
  std::vector<Cell> cells;  // one per protocol
};

Cell cell(std::string text) {
  std::size_t end = 0;
  while (end < text.size() && (std::isdigit(static_cast<unsigned char>(text[end])) != 0 || text[end] == '-' || text[end] == ',')) ++end;
  return {std::move(text), end};
}

std::string number(double value) { return std::isfinite(value) ? fmt::format("{:.6g}", value) : "-"; }

// The deviation to two digits, the mean to the same decimal place.
std::string mean_and_deviation(double mean, double deviation, const TextStyle& style) {
  if (!std::isfinite(mean)) return "-";
  const char* sign = style.unicode ? "±" : "+-";
  constexpr double kRounding = 1e-13;              // relative; what is left of equal values after averaging
  if (std::isnan(deviation)) return number(mean);  // a single number has none
  if (!std::isfinite(deviation) || deviation <= kRounding * std::abs(mean)) return fmt::format("{} {} 0", number(mean), sign);
  const int decimals = 1 - static_cast<int>(std::floor(std::log10(deviation)));
  if (decimals > 8 || std::abs(mean) >= 1e9) return fmt::format("{:.6g} {} {:.2g}", mean, sign, deviation);
  return fmt::format("{:.{}f} {} {:.{}f}", mean, std::max(decimals, 0), sign, deviation, std::max(decimals, 0));
}

std::string duration(double seconds) { return seconds < 0.1 ? fmt::format("{:.2f} ms", 1e3 * seconds) : fmt::format("{:.2f} s", seconds); }

std::string spaced(std::string name) {
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

class Lines {
 public:
  Lines(const Summary& summary, const TextStyle& style) : summary_(summary), style_(style) {}

  std::vector<Row> all() {
    std::set<std::string> seen;
    for (const char* first : {"consensus_value", "centralised_value", "bias", "disagreement", "error", "rounds_to_convergence"})
      add_metric(first, seen);
    for (const MetricEntry& entry : metric_table()) {
      const std::string name(entry.name);
      if (name != "rounds" && !name.starts_with("messages_")) add_metric(name, seen);
    }
    add("rounds", [this](const ProtocolResult& result) { return rounds_of(result); });
    const std::string sum = summary_.runs > 1 ? ", all runs" : "";
    add("messages sent" + sum, [](const ProtocolResult& result) { return grouped(result.totals.sent); });
    add("messages lost" + sum, [](const ProtocolResult& result) {
      const double decided = static_cast<double>(result.totals.lost + result.totals.delivered);
      const double share = decided > 0.0 ? 100.0 * static_cast<double>(result.totals.lost) / decided : 0.0;
      return result.totals.lost == 0 ? std::string("0") : fmt::format("{} ({:.1f} %)", grouped(result.totals.lost), share);
    });
    add("time" + sum, [](const ProtocolResult& result) { return duration(result.seconds); });
    add("rounds/s", [](const ProtocolResult& result) {
      return result.seconds > 0.0 ? grouped(static_cast<std::uint64_t>(static_cast<double>(result.rounds) / result.seconds)) : "-";
    });
    return std::move(rows_);
  }

 private:
  template <class Text>
  void add(std::string label, Text&& text_of) {
    Row row{std::move(label), {}};
    for (const ProtocolResult& result : summary_.protocols) row.cells.push_back(result.runs == 0 ? cell("-") : cell(text_of(result)));
    rows_.push_back(std::move(row));
  }

  std::string rounds_of(const ProtocolResult& result) const {
    const std::string range = result.fewest_rounds == result.most_rounds
                                  ? grouped(result.most_rounds)
                                  : fmt::format("{} to {}", grouped(result.fewest_rounds), grouped(result.most_rounds));
    if (result.converged == 0) return range;
    return range + (summary_.runs > 1 ? fmt::format(" ({} of {} agreed)", result.converged, result.runs) : " (agreed)");
  }

  void add_value(std::string label, const std::string& key) {
    add(std::move(label), [&](const ProtocolResult& result) {
      const auto found = result.mean.find(key);
      if (found == result.mean.end()) return std::string("-");
      if (summary_.runs == 1 && key == "rounds_to_convergence" && std::isnan(found->second)) return std::string("never");
      return summary_.runs > 1 ? over_runs(result, key) : number(found->second);
    });
  }

  // A mean that not every run has a part in says so.
  [[nodiscard]] std::string over_runs(const ProtocolResult& result, const std::string& key) const {
    const std::string text = mean_and_deviation(result.mean.at(key), result.deviation.at(key), style_);
    const double share = result.share.at(key), runs = static_cast<double>(result.per_run.size());
    return share < 1.0 ? fmt::format("{} ({:.0f} of {} runs)", text, share * runs, runs) : text;
  }

  [[nodiscard]] bool anyone_has(const std::string& key) const {
    return std::any_of(summary_.protocols.begin(), summary_.protocols.end(), [&](const auto& result) { return result.mean.contains(key); });
  }

  void add_metric(const std::string& name, std::set<std::string>& seen) {
    if (!seen.insert(name).second) return;
    if (anyone_has(name)) add_value(spaced(name), name);
    std::size_t components = 0;
    while (anyone_has(fmt::format("{}[{}]", name, components))) ++components;
    for (std::size_t i = 0; i < std::min(components, kComponentsShown); ++i)
      add_value(fmt::format("{} [{}]", i == 0 ? spaced(name) : std::string(name.size(), ' '), i), fmt::format("{}[{}]", name, i));
    if (components > kComponentsShown) {
      const std::size_t more = components - kComponentsShown;
      rows_.push_back({fmt::format("{} {} {} more", std::string(name.size(), ' '), style_.unicode ? "…" : "...", more), {}});
    }
  }

  const Summary& summary_;
  const TextStyle& style_;
  std::vector<Row> rows_;
};

std::string padded(const std::string& text, std::size_t width) {
  const std::size_t shown = shown_width(text);
  return text + std::string(width > shown ? width - shown : 0, ' ');
}

// Widths of one protocol's column.
struct Column {
  std::size_t before = 0, after = 0, heading = 0;  // characters before and from the decimal point on, and of the name above
  [[nodiscard]] std::size_t width() const { return std::max(heading, before + after); }
};

std::vector<Column> measure(const Summary& summary, const std::vector<Row>& rows) {
  std::vector<Column> columns(summary.protocols.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    columns[i].heading = shown_width(summary.protocols[i].name);
    for (const Row& row : rows) {
      if (row.cells.empty()) continue;
      columns[i].before = std::max(columns[i].before, row.cells[i].point);
      columns[i].after = std::max(columns[i].after, shown_width(row.cells[i].text) - row.cells[i].point);
    }
  }
  return columns;
}

// The rows for protocols [first, last).
std::string block(const Summary& summary, const std::vector<Row>& rows, const std::vector<Column>& columns, std::size_t first,
                  std::size_t last, std::size_t label_width, const TextStyle& style) {
  std::string out;
  const auto end_line = [&out](const std::string& line) { out += line.substr(0, line.find_last_not_of(' ') + 1) + "\n"; };
  std::string heading(kIndent + label_width, ' '), rule = std::string(kIndent, ' ');
  std::size_t rule_width = label_width;
  for (std::size_t i = first; i < last; ++i) {
    heading += std::string(kGap, ' ') + padded(summary.protocols[i].name, columns[i].width());
    rule_width += kGap + columns[i].width();
  }
  end_line(heading);
  for (std::size_t i = 0; i < rule_width; ++i) rule += style.unicode ? "─" : "-";
  out += toned(rule, Tone::faint, style) + "\n";
  for (const Row& row : rows) {
    std::string line(kIndent, ' ');
    line += padded(row.label, label_width);
    for (std::size_t i = first; i < last && !row.cells.empty(); ++i) {
      const Cell& value = row.cells[i];
      line += std::string(kGap, ' ') + padded(std::string(columns[i].before - value.point, ' ') + value.text, columns[i].width());
    }
    end_line(line);
  }
  return out;
}

std::string verdict(const Summary& summary, Tone& tone) {
  tone = summary.passed() ? Tone::good : Tone::bad;
  switch (summary.exit) {
    case Exit::ok:
      return summary.criteria.empty() ? "DONE" : "PASSED";
    case Exit::criterion_not_met:
      return "NOT MET";
    case Exit::timed_out:
      return "TIMED OUT";
    case Exit::interrupted:
    case Exit::terminated:
      return "INTERRUPTED";
    case Exit::run_failed:
      return summary.ending == Ending::out_of_time ? "INCOMPLETE" : "FAILED";
    default:
      return "FAILED";
  }
}

std::string heading(const Summary& summary, const TextStyle& style, std::size_t width) {
  Tone tone = Tone::plain;
  const std::string word = verdict(summary, tone);
  const std::size_t used = kIndent + shown_width(summary.experiment) + shown_width(word);
  const std::string space(width > used + 2 ? width - used : 2, ' ');
  const char* dot = style.unicode ? " · " : ", ";
  std::string facts = fmt::format("{}{}{}{}seed {}", name_of(summary.mode), dot, counted(summary.agents, "agent"), dot, summary.seed.value);
  if (summary.runs > 1)
    facts += fmt::format(" to {}{}mean {} std over {} runs", summary.seed.value + summary.runs - 1, dot, style.unicode ? "±" : "+-",
                         summary.protocols.empty() ? summary.runs : summary.protocols.front().runs);
  return fmt::format("  {}{}{}\n  {}\n\n", toned(summary.experiment, Tone::strong, style), space, toned(word, tone, style),
                     toned(facts, Tone::faint, style));
}

// The value stands before the text, so that long criteria need no column of their own; below it what several metrics came to.
std::string criteria(const Summary& summary, const TextStyle& style) {
  std::string out;
  std::size_t width = 0;
  for (const auto& criterion : summary.criteria) width = std::max(width, number(criterion.value).size());
  for (const auto& criterion : summary.criteria) {
    const std::string mark = !summary.complete ? (style.unicode ? "?" : "open   ")
                             : style.unicode   ? (criterion.met ? "✓" : "✗")
                                               : (criterion.met ? "met    " : "NOT met");
    const Tone tone = !summary.complete ? Tone::plain : criterion.met ? Tone::good : Tone::bad;
    const std::string value = padded(number(criterion.value), width);
    const std::size_t margin = kIndent + shown_width(mark) + 1 + width + 2;
    const std::size_t room = std::max<std::size_t>(style.width, margin + 20) - margin;
    const auto lines = wrapped(criterion.text, room);
    out += fmt::format("  {} {}  {}\n", toned(mark, tone, style), value, lines.front());
    for (std::size_t i = 1; i < lines.size(); ++i) out += std::string(margin, ' ') + lines[i] + "\n";
    std::string values = criterion.undefined.empty() ? "" : fmt::format("something in it is {}", criterion.undefined);
    if (criterion.metrics.size() < 2 && values.empty()) continue;  // the value says it
    for (const auto& [name, found] : criterion.metrics) values += fmt::format("{}{} {}", values.empty() ? "" : ", ", name, number(found));
    for (const auto& line : wrapped(values, room)) out += fmt::format("{}{}\n", std::string(margin, ' '), toned(line, Tone::faint, style));
  }
  return out.empty() ? out : out + "\n";
}

// One line per protocol that drew apart in some run, with the numbers of the first.
std::string diverged(const Summary& summary, const TextStyle& style) {
  std::string out;
  for (const ProtocolResult& result : summary.protocols) {
    const auto is = [](const RunMetrics& run) { return run.diverged.has_value(); };
    const auto first = std::find_if(result.per_run.begin(), result.per_run.end(), is);
    if (first == result.per_run.end()) continue;
    const auto count = std::count_if(result.per_run.begin(), result.per_run.end(), is);
    const std::string which =
        result.per_run.size() > 1 ? fmt::format(" in {} of {} runs, with seed {}", count, result.per_run.size(), first->seed.value) : "";
    const Divergence& found = *first->diverged;
    const std::string text =
        fmt::format("{} {} diverged{}: the {} rose from {:.3g} in round {} to {:.3g} in round {}", style.unicode ? "✗" : "!", result.name,
                    which, found.of_error ? "error" : "disagreement", found.from, found.from_round, found.to, found.to_round);
    for (const auto& line : wrapped(text, std::max<std::size_t>(style.width, kIndent + 20) - kIndent))
      out += fmt::format("  {}\n", toned(line, Tone::bad, style));
  }
  return out.empty() ? out : out + "\n";
}

std::string paragraph(const std::string& text, Tone tone, const TextStyle& style) {
  std::string out;
  for (const std::string& line : wrapped(text, std::max<std::size_t>(style.width, 40) - kIndent))
    out += fmt::format("  {}\n", toned(line, tone, style));
  return out;
}

}  // namespace

std::string render(const Summary& summary, const TextStyle& style) {
  const std::vector<Row> rows = Lines(summary, style).all();
  const std::vector<Column> columns = measure(summary, rows);
  std::size_t label_width = 0;
  for (const Row& row : rows) label_width = std::max(label_width, shown_width(row.label));
  std::string blocks;
  std::size_t widest = 0;
  for (std::size_t first = 0; first < columns.size();) {
    std::size_t width = kIndent + label_width, last = first;
    while (last < columns.size() && (last == first || width + kGap + columns[last].width() <= style.width))
      width += kGap + columns[last++].width();
    blocks += block(summary, rows, columns, first, last, label_width, style) + "\n";
    widest = std::max(widest, width);
    first = last;
  }
  std::string out = "\n" + heading(summary, style, std::clamp<std::size_t>(widest, 40, std::max<std::size_t>(style.width, 40))) + blocks;
  out += diverged(summary, style) + criteria(summary, style);
  if (!summary.refused.empty()) {
    std::set<std::string> writers;
    for (const Refusal& refusal : summary.refused)
      if (!refusal.writer.empty()) writers.insert(refusal.writer);
    const std::uint64_t samples = samples_of(summary.refused);
    out += fmt::format("  {}\n", toned(fmt::format("refused {} {} of {}: see \"rejected\" in summary.json", grouped(samples),
                                                   noun(samples, "sample"), counted(writers.size(), "participant")),
                                       Tone::bad, style));
  }
  // Other failures are told on standard error; an interrupted run ends like any other, only earlier.
  if (summary.exit == Exit::interrupted || summary.exit == Exit::terminated)
    out += fmt::format("  {}\n", toned(summary.error, Tone::bad, style));
  if (!summary.complete) out += paragraph("INCOMPLETE: " + summary.incomplete, Tone::bad, style);
  for (const std::string& line : told(summary.ends)) out += paragraph(line, Tone::plain, style);
  std::string facts = summary.startup_seconds ? "start-up " + duration(*summary.startup_seconds) : "";
  if (summary.trace_hash) facts += fmt::format("{}trace {:016x}", facts.empty() ? "" : ", ", *summary.trace_hash);
  if (!facts.empty()) out += fmt::format("  {}\n", toned(facts, Tone::faint, style));
  out += fmt::format("  {}\n", summary.output.string());
  return out;
}

}  // namespace consort
