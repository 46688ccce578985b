#pragma once
/// Names and shapes of the numbers in a message or an estimate: sent once per agent, so the data samples stay bare numbers.

#include <cstddef>
#include <string>
#include <vector>

namespace consort {

struct Field {
  std::string name;
  std::size_t rows = 1, cols = 1;
  [[nodiscard]] std::size_t size() const { return rows * cols; }
  bool operator==(const Field&) const = default;
};

/// Fields lie one after the other, each column-major.
struct Layout {
  std::vector<Field> fields;
  std::size_t noise_offset = 0;  ///< the part of a message that link noise disturbs: [noise_offset, noise_offset + noise_size)
  std::size_t noise_size = 0;
  [[nodiscard]] std::size_t size() const {
    std::size_t total = 0;
    for (const auto& field : fields) total += field.size();
    return total;
  }
  bool operator==(const Layout&) const = default;
};

}  // namespace consort
