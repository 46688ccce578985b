#pragma once
/// The run's connections to other hosts, one each, in a thread of its own: `consort lend` at the far end starts processes, tells what they
/// write and how they end, and ends them when the connection closes.

#include "orchestrator/run/launch.hpp"
#include "orchestrator/script/hosts.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace consort {

class LineChannel;

/// What the far end says of itself.
struct Lent {
  std::string build;  ///< as Build::word() has it
  std::string host;   ///< as its processes name it
  std::string arithmetic;
};

class Connection {
 public:
  /// Opens it; `command`: what leads to `consort lend`. What it writes on standard error is in <log directory>/host-<name>.log; where there
  /// is no such folder, in memory.
  Connection(std::string name, const std::vector<std::string>& command, std::filesystem::path log_directory);
  ~Connection();  ///< closes it, which ends everything at the far end, and waits for that for a moment
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  /// Waits for its first word. Throws RunError, with the remedy, if it closes instead, or somebody has `interrupt`ed the run.
  const Lent& lent(const std::atomic<int>* interrupt = nullptr);
  /// Whether processes there can be found at `address`, or an interface of that name, on these ports: the numeric address. Throws RunError.
  std::string use(const std::string& address, const std::vector<std::uint16_t>& ports);
  /// Sends an order, and waits for the line that has the word `answer`. Throws RunError if the connection closes.
  std::string ask(const std::string& order, const std::string& answer);

  /// Ends everything at the far end. The destructor waits for that.
  void leave();
  void start(const std::string& name, const std::string& program, const std::vector<std::string>& arguments, const std::string& key);
  void signal(const std::string& name, int number);
  std::optional<Death> next_death();
  /// Waits for the pids of those that were to start since the last call; who could not, and whose connection has closed, dies instead.
  std::map<std::string, pid_t> take_started();
  [[nodiscard]] std::size_t alive() const;
  [[nodiscard]] const std::string& host() const { return lent_->host; }

 private:
  void run();
  void hear(const std::string& line);
  void keep_log(const std::string& name, const std::string& text) const;
  void say(const std::string& line);
  void close_files() const;
  void conclude(const std::string& why);
  [[nodiscard]] std::string remedy(int code) const;

  const std::string name_;
  const std::vector<std::string> command_;
  const std::filesystem::path log_directory_;
  std::string errors_;  // the file of its standard error
  int memory_ = -1;
  pid_t pid_ = 0;
  int wake_ = -1;  // the thread has something to send

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::vector<std::string> to_say_;
  bool ending_ = false;
  std::optional<std::string> closed_;  // and why
  std::optional<Lent> lent_;
  std::string awaited_;                           // the word of the line that is asked for
  std::optional<std::string> answer_;             // that line
  std::map<std::string, pid_t> alive_, started_;  // pid 0: not known yet
  std::deque<Death> deaths_;
  std::unique_ptr<LineChannel> channel_;  // the thread's
  std::thread thread_;
};

}  // namespace consort
