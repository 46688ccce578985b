// Graph files that are read line by line: edge lists, adjacency as CSV, MatrixMarket.

#include "core/number_text.hpp"
#include "orchestrator/script/graph_file.hpp"
#include "orchestrator/script/yaml.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <optional>
#include <sstream>

namespace consort::script {
namespace {

constexpr std::string_view kBlank = " \t\r";

std::string_view trimmed(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kBlank);
  return first == std::string_view::npos ? std::string_view{} : text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

// The lines of a text, without blank ones and comments, and where they stand.
class Lines {
 public:
  Lines(std::string_view text, char comment) : rest_(text), comment_(comment) {}

  [[nodiscard]] std::size_t number() const { return number_; }
  std::optional<std::string_view> next() {
    while (!rest_.empty()) {
      const std::size_t end = std::min(rest_.find('\n'), rest_.size());
      const std::string_view line = trimmed(rest_.substr(0, end));
      rest_.remove_prefix(std::min(end + 1, rest_.size()));
      ++number_;
      if (!line.empty() && line.front() != comment_) return line;
    }
    return std::nullopt;
  }

 private:
  std::string_view rest_;
  char comment_;
  std::size_t number_ = 0;
};

std::vector<std::string_view> words(std::string_view line) {
  std::vector<std::string_view> out;
  while (!(line = trimmed(line)).empty()) {
    const std::size_t end = std::min(line.find_first_of(kBlank), line.size());
    out.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
  return out;
}

std::vector<std::string_view> cells(std::string_view line) {
  std::vector<std::string_view> out;
  for (std::size_t start = 0; start <= line.size();) {
    const std::size_t comma = std::min(line.find(',', start), line.size());
    out.push_back(trimmed(line.substr(start, comma - start)));
    start = comma + 1;
  }
  return out;
}

std::string lower(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return out;
}

// The weight that follows the two nodes: nothing, a number, or what Python's networkx writes: {'weight': 0.5}.
double weight_after(std::size_t number, std::string_view rest) {
  rest = trimmed(rest);
  if (rest.empty() || rest == "{}") return 1.0;
  if (!rest.starts_with('{')) return graph_weight(number, rest);
  const std::size_t key = rest.find("'weight':");
  if (key == std::string_view::npos) return 1.0;
  rest.remove_prefix(key + 9);
  return graph_weight(number, trimmed(rest.substr(0, rest.find_first_of(",}"))));
}

std::size_t whole(std::size_t line, std::string_view text, std::size_t most) {
  const auto value = parse_number<std::uint64_t>(text);
  if (!value || *value < 1 || *value > most)
    throw GraphFileError(line, fmt::format("found '{}'; allowed: a whole number from 1 to {}", shown(text), most));
  return *value;
}

struct MarketForm {
  bool coordinate, pattern, symmetric;
};

MarketForm market_form(std::string_view line) {
  const auto head = words(line);
  const auto is = [&](std::size_t at, std::string_view word) { return at < head.size() && lower(head[at]) == word; };
  const bool layout = is(2, "coordinate") || is(2, "array"),
             field = is(3, "real") || is(3, "integer") || (is(3, "pattern") && is(2, "coordinate"));
  if (!is(0, "%%matrixmarket") || !is(1, "matrix") || !layout || !field || !(is(4, "general") || is(4, "symmetric")))
    throw GraphFileError(1,
                         fmt::format("found '{}'; allowed: %%MatrixMarket matrix, coordinate or array, real, integer or pattern, general "
                                     "or symmetric",
                                     shown(line)));
  return {is(2, "coordinate"), is(3, "pattern"), is(4, "symmetric")};
}

void read_coordinates(Lines& lines, const MarketForm& form, std::size_t size, std::size_t entries, GraphBuilder& into) {
  std::size_t read = 0;
  for (; const auto line = lines.next(); ++read) {
    const auto entry = words(*line);
    if (entry.size() != (form.pattern ? 2 : 3))
      throw GraphFileError(lines.number(),
                           fmt::format("found '{}'; allowed: row, column{}", shown(*line), form.pattern ? "" : " and weight"));
    const std::size_t row = whole(lines.number(), entry[0], size), column = whole(lines.number(), entry[1], size);
    const double weight = form.pattern ? 1.0 : graph_weight(lines.number(), entry[2]);
    into.add_entry(lines.number(), row, column, weight);
    if (form.symmetric) into.add_entry(lines.number(), column, row, weight);
  }
  if (read != entries)
    throw GraphFileError(lines.number(), fmt::format("found {} entries; allowed: {}, as the file announces", read, entries));
}

void read_columns(Lines& lines, const MarketForm& form, std::size_t size, GraphBuilder& into) {
  for (std::size_t column = 1; column <= size; ++column)
    for (std::size_t row = form.symmetric ? column : 1; row <= size; ++row) {
      const auto line = lines.next();
      if (!line) throw GraphFileError(lines.number(), fmt::format("it ends before row {} of column {}", row, column));
      const double weight = graph_weight(lines.number(), *line);
      into.add_entry(lines.number(), row, column, weight);
      if (form.symmetric && row != column) into.add_entry(lines.number(), column, row, weight);
    }
  if (const auto line = lines.next()) throw GraphFileError(lines.number(), fmt::format("found '{}' after the last entry", shown(*line)));
}

}  // namespace

void read_edge_list(std::string_view text, GraphBuilder& into) {
  Lines lines(text, '#');
  while (const auto line = lines.next()) {
    const auto word = words(*line);
    if (word.size() < 2)
      throw GraphFileError(lines.number(),
                           fmt::format("found '{}'; allowed: sender, receiver and, if it has one, its weight", shown(*line)));
    const std::string_view rest = line->substr(static_cast<std::size_t>(word[1].data() + word[1].size() - line->data()));
    into.add_edge(lines.number(), std::string(word[0]), std::string(word[1]), weight_after(lines.number(), rest), true);
  }
}

void read_adjacency_csv(std::string_view text, GraphBuilder& into) {
  Lines lines(text, '#');
  std::size_t row = 0, size = 0, names = 0;  // names: cells that stand before the numbers of a row
  while (const auto line = lines.next()) {
    const auto cell = cells(*line);
    if (row == 0 && size == 0 && std::any_of(cell.begin(), cell.end(), [](auto each) { return !finite_number(each); })) {
      names = cell.front().empty() ? 1 : 0;  // as pandas writes a table with its index
      size = cell.size() - names;
      continue;
    }
    if (row++ == 0) {
      size = size == 0 ? cell.size() : size;
      into.add_matrix(lines.number(), size, size);
    }
    if (cell.size() != size + names || row > size)
      throw GraphFileError(lines.number(),
                           fmt::format("found row {} with {} cells; allowed: {} rows of {}", row, cell.size(), size, size + names));
    for (std::size_t column = 1; column <= size; ++column)
      into.add_entry(lines.number(), row, column, graph_weight(lines.number(), cell[column - 1 + names]));
  }
  if (row != size || row == 0) throw GraphFileError(lines.number(), fmt::format("found {} rows; allowed: {}, one per agent", row, size));
}

void read_matrix_market(std::string_view text, GraphBuilder& into) {
  const MarketForm form = market_form(trimmed(text.substr(0, text.find('\n'))));
  Lines lines(text, '%');
  const auto head = lines.next();
  const auto sizes = head ? words(*head) : std::vector<std::string_view>{};
  if (sizes.size() != (form.coordinate ? 3 : 2))
    throw GraphFileError(lines.number(),
                         fmt::format("found no line with the {}", form.coordinate ? "rows, columns and entries" : "rows and columns"));
  constexpr std::size_t kMost = std::size_t{1} << 32;
  const std::size_t rows = whole(lines.number(), sizes[0], kMost), columns = whole(lines.number(), sizes[1], kMost);
  into.add_matrix(lines.number(), rows, columns);
  if (!form.coordinate) return read_columns(lines, form, rows, into);
  const auto entries = parse_number<std::uint64_t>(sizes[2]);
  if (!entries) throw GraphFileError(lines.number(), fmt::format("found '{}' entries; allowed: a whole number", shown(sizes[2])));
  read_coordinates(lines, form, rows, *entries, into);
}

}  // namespace consort::script
