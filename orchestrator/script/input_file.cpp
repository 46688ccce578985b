#include "orchestrator/script/input_file.hpp"

#include "core/errors.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

namespace consort {
namespace {

constexpr int kPatiences = 6;  // for all of a pipe
constexpr const char* kReadable = "; allowed: a file, or a pipe";

double seconds(std::chrono::milliseconds time) { return std::chrono::duration<double>(time).count(); }

// An open file that closes itself.
class Descriptor {
 public:
  // A pipe nobody writes to would keep open() waiting.
  explicit Descriptor(const std::filesystem::path& file) : number_(::open(file.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC | O_NOCTTY)) {
    if (number_ < 0) throw ConfigError(fmt::format("cannot be read ({}){}", std::strerror(errno), kReadable));
  }
  ~Descriptor() { ::close(number_); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int get() const { return number_; }

 private:
  int number_;
};

}  // namespace

std::string read_input(const std::filesystem::path& file, std::size_t most, std::chrono::milliseconds patience) {
  struct stat kind {};
  if (::stat(file.c_str(), &kind) != 0) throw ConfigError(fmt::format("cannot be read ({}){}", std::strerror(errno), kReadable));
  if (S_ISDIR(kind.st_mode)) throw ConfigError(fmt::format("is a folder{}", kReadable));
  if (!S_ISREG(kind.st_mode) && !S_ISFIFO(kind.st_mode))
    throw ConfigError(fmt::format("is a {}{}", S_ISSOCK(kind.st_mode) ? "socket" : "device", kReadable));
  const Descriptor in(file);
  std::string text;
  std::array<char, 1 << 16> buffer{};
  const auto give_up = std::chrono::steady_clock::now() + kPatiences * patience;
  while (true) {
    pollfd ready{in.get(), POLLIN, 0};
    if (::poll(&ready, 1, static_cast<int>(patience.count())) == 0 || std::chrono::steady_clock::now() > give_up)
      throw ConfigError(fmt::format("is a pipe that gave nothing for {0:g} s, or did not end within {1:g} s{2} that is written to",
                                    seconds(patience), seconds(kPatiences * patience), kReadable));
    const ssize_t got = ::read(in.get(), buffer.data(), buffer.size());
    if (got == 0) return text;
    if (got < 0 && errno != EAGAIN && errno != EINTR)
      throw ConfigError(fmt::format("cannot be read ({}){}", std::strerror(errno), kReadable));
    if (got > 0) text.append(buffer.data(), static_cast<std::size_t>(got));
    if (text.size() > most) throw ConfigError(fmt::format("holds more than {} bytes; allowed: at most so many", most));
  }
}

}  // namespace consort
