#pragma once
/// Rows of equal length, added at the end and read anywhere. They lie in blocks, and a block that is full may be put on a shelf that is
/// not memory: then there may be as many as the shelf holds.

#include "core/errors.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

namespace consort {

/// A full block, wherever it lies.
class Block {
 public:
  virtual ~Block() = default;
  [[nodiscard]] virtual std::span<const std::byte> bytes() const = 0;
  /// It will not be read for a while.
  virtual void rest() const {}
};

class Shelf {
 public:
  virtual ~Shelf() = default;
  /// Puts a block away; nullptr where there is no room.
  virtual std::shared_ptr<const Block> put(std::span<const std::byte> block) = 0;
};

/// Not to be read by two threads at once.
template <class T>
class Rows {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  /// `shelf`: for the blocks that are full. Without one, or where it is full too, they stay in memory.
  void add(std::span<const T> row, Shelf* shelf = nullptr) {
    if (size_ == 0) set_width(row.size());
    check(row.size() == width_, "Rows::add: all rows have one length");
    newest_.insert(newest_.end(), row.begin(), row.end());
    if (++size_ % per_block_ == 0 && width_ > 0) put_away(shelf);
  }
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool operator==(const Rows& other) const {
    if (size_ != other.size_) return false;
    for (std::size_t row = 0; row < size_; ++row)
      if (!std::ranges::equal((*this)[row], other[row])) return false;
    return true;
  }
  [[nodiscard]] std::span<const T> operator[](std::size_t row) const {
    return block(row / per_block_).subspan(row % per_block_ * width_, width_);
  }

 private:
  static constexpr std::size_t kBlockBytes = std::size_t{1} << 20;

  struct InMemory : Block {
    std::vector<T> numbers;
    [[nodiscard]] std::span<const std::byte> bytes() const override { return std::as_bytes(std::span(numbers)); }
  };

  void set_width(std::size_t width) {
    width_ = width;
    per_block_ = std::max<std::size_t>(1, kBlockBytes / sizeof(T) / std::max<std::size_t>(1, width));
  }

  void put_away(Shelf* shelf) {
    std::shared_ptr<const Block> block;
    if (shelf) block = shelf->put(std::as_bytes(std::span(newest_)));
    if (!block) {
      auto held = std::make_shared<InMemory>();
      held->numbers.swap(newest_);
      block = std::move(held);
    }
    full_.push_back(std::move(block));
    newest_.clear();
  }

  [[nodiscard]] std::span<const T> block(std::size_t number) const {
    if (number >= full_.size()) return newest_;
    if (std::find(awake_.begin(), awake_.end(), number) == awake_.end()) {
      if (awake_.back() < full_.size()) full_[awake_.back()]->rest();
      std::move_backward(awake_.begin(), awake_.end() - 1, awake_.end());
      awake_.front() = number;
    }
    const auto bytes = full_[number]->bytes();
    return {reinterpret_cast<const T*>(bytes.data()), bytes.size() / sizeof(T)};
  }

  std::size_t width_ = 0, per_block_ = 1, size_ = 0;
  std::vector<std::shared_ptr<const Block>> full_;
  std::vector<T> newest_;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  mutable std::array<std::size_t, 3> awake_{kNone, kNone, kNone};  // blocks that have been read of late; the others rest
};

}  // namespace consort
