#include "orchestrator/run/spill.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <utility>

namespace consort {
namespace {

// Reads like memory.
class Mapped : public Block {
 public:
  Mapped(void* at, std::size_t size) : at_(at), size_(size) {}
  ~Mapped() override { ::munmap(at_, size_); }
  Mapped(const Mapped&) = delete;
  Mapped& operator=(const Mapped&) = delete;
  [[nodiscard]] std::span<const std::byte> bytes() const override { return {static_cast<const std::byte*>(at_), size_}; }
  void rest() const override { ::madvise(at_, size_, MADV_DONTNEED); }

 private:
  void* at_;
  std::size_t size_;
};

class Spill : public Shelf {
 public:
  explicit Spill(std::filesystem::path folder) : folder_(std::move(folder)), page_(static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE))) {}
  ~Spill() override {
    if (file_ >= 0) ::close(file_);
  }
  Spill(const Spill&) = delete;
  Spill& operator=(const Spill&) = delete;

  std::shared_ptr<const Block> put(std::span<const std::byte> block) override {
    if (file_ < 0) file_ = ::open(folder_.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
    if (file_ < 0) return nullptr;
    const auto offset = static_cast<off_t>(end_);
    for (std::size_t done = 0; done < block.size();) {
      const ssize_t written = ::pwrite(file_, block.data() + done, block.size() - done, offset + static_cast<off_t>(done));
      if (written <= 0) return nullptr;
      done += static_cast<std::size_t>(written);
    }
    void* at = ::mmap(nullptr, block.size(), PROT_READ, MAP_SHARED, file_, offset);
    if (at == MAP_FAILED) return nullptr;
    end_ += (block.size() + page_ - 1) / page_ * page_;
    return std::make_shared<Mapped>(at, block.size());
  }

 private:
  std::filesystem::path folder_;
  int file_ = -1;  // made when it is needed
  std::uint64_t page_, end_ = 0;
};

}  // namespace

std::shared_ptr<Shelf> spill_in(const std::filesystem::path& folder) { return folder.empty() ? nullptr : std::make_shared<Spill>(folder); }

}  // namespace consort
