#include "orchestrator/run/line_channel.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <utility>

namespace consort {
namespace {

constexpr std::size_t kLongestLine = std::size_t{16} << 20;  // bytes

void never_block(int descriptor) { ::fcntl(descriptor, F_SETFL, ::fcntl(descriptor, F_GETFL) | O_NONBLOCK); }

}  // namespace

LineChannel::LineChannel(int in, int out) : in_(in), out_(out) {
  never_block(in_);
  never_block(out_);
}

LineChannel::~LineChannel() {
  close_in();
  close_out();
}

void LineChannel::close_in() {
  if (in_ >= 0) ::close(std::exchange(in_, -1));
}

void LineChannel::close_out() {
  if (out_ >= 0) ::close(std::exchange(out_, -1));
  to_send_.clear();
}

void LineChannel::send(std::string_view line) {
  if (out_ < 0) return;
  to_send_.append(line).append("\n");
  flush();
}

void LineChannel::flush() {
  while (out_ >= 0 && !to_send_.empty()) {
    const ssize_t written = ::write(out_, to_send_.data(), to_send_.size());
    if (written >= 0)
      to_send_.erase(0, static_cast<std::size_t>(written));
    else if (errno == EAGAIN)
      return;
    else if (errno != EINTR)
      close_out();
  }
}

std::vector<std::string> LineChannel::take() {
  std::array<char, 65536> bytes{};
  while (in_ >= 0) {
    const ssize_t got = ::read(in_, bytes.data(), bytes.size());
    if (got > 0)
      received_.append(bytes.data(), static_cast<std::size_t>(got));
    else if (got < 0 && errno == EAGAIN)
      break;
    else if (got == 0 || errno != EINTR)
      close_in();
    if (received_.size() > kLongestLine) break;
  }
  std::vector<std::string> lines;
  std::size_t begin = 0;
  for (std::size_t end = 0; (end = received_.find('\n', begin)) != std::string::npos; begin = end + 1)
    lines.push_back(received_.substr(begin, end - begin));
  received_.erase(0, begin);
  if (received_.size() > kLongestLine) close_in();
  return lines;
}

void LineChannel::wait_for(std::vector<pollfd>& descriptors) const {
  if (in_ >= 0) descriptors.push_back({in_, POLLIN, 0});
  if (out_ >= 0 && !to_send_.empty()) descriptors.push_back({out_, POLLOUT, 0});
}

}  // namespace consort
