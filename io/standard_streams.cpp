#include "io/standard_streams.hpp"

#include "core/errors.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>

namespace consort::streams {
namespace {

std::string& reason() {
  static std::string text;
  return text;
}

// 0, or the error that kept some of it from being written.
int write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written >= 0) {
      text.remove_prefix(static_cast<std::size_t>(written));
    } else if (errno == EAGAIN) {  // somebody shares it who does not want to wait
      pollfd room{descriptor, POLLOUT, 0};
      ::poll(&room, 1, -1);
    } else if (errno != EINTR) {
      return errno;
    }
  }
  return 0;
}

}  // namespace

void prepare() {
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (::fcntl(descriptor, F_GETFD) >= 0) continue;
    // open() gives the lowest number that is free. What is written to standard output must fail, as it is lost.
    static_cast<void>(::open("/dev/null", descriptor == STDERR_FILENO ? O_WRONLY : O_RDONLY));
  }
  for (const int number : {SIGPIPE, SIGXFSZ}) std::signal(number, SIG_IGN);
}

void put(std::string_view text) {
  if (!lost().empty()) return;
  if (const int error = write_all(STDOUT_FILENO, text); error != 0) reason() = std::strerror(error);
}

void tell(std::string_view text) { static_cast<void>(write_all(STDERR_FILENO, text)); }

const std::string& lost() { return reason(); }

int concluded(std::string_view program, int code) {
  if (lost().empty()) return code;
  tell(std::string(program) + ": standard output cannot be written (" + lost() + "); what was to stand there is lost\n");
  const bool failed = code != static_cast<int>(Exit::ok) && code != static_cast<int>(Exit::criterion_not_met);
  return failed ? code : static_cast<int>(Exit::run_failed);
}

}  // namespace consort::streams
