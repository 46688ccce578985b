#pragma once
/// Lines of text both ways over a pair of file descriptors, neither of which anybody waits for longer than he wants to.

#include <poll.h>

#include <string>
#include <string_view>
#include <vector>

namespace consort {

class LineChannel {
 public:
  /// Closes them at its end.
  LineChannel(int in, int out);
  ~LineChannel();
  LineChannel(const LineChannel&) = delete;
  LineChannel& operator=(const LineChannel&) = delete;

  /// Written as far as the other end takes it now, and then whenever flush() is called. What a closed end does not take is lost.
  void send(std::string_view line);
  void flush();
  /// Whatever has come, whole lines; a line longer than anybody's closes the channel.
  std::vector<std::string> take();
  /// What poll() is to wait for.
  void wait_for(std::vector<pollfd>& descriptors) const;
  /// The other end may still say something.
  [[nodiscard]] bool open() const { return in_ >= 0; }
  void close_out();

 private:
  void close_in();
  int in_, out_;
  std::string received_, to_send_;
};

}  // namespace consort
