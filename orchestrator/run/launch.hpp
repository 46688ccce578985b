#pragma once
/// Child processes: started with a log of their own, watched, and never left behind.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace consort {

/// How one child ended.
struct Death {
  std::string name;  ///< as given to start()
  pid_t pid = 0;
  int signal = 0;  ///< 0: it exited
  int exit_code = 0;
  std::string log_tail = {};               ///< last lines of its log
  std::string host = {};                   ///< empty: this one
  std::string how = {};                    ///< where nobody has seen it end: what is known instead
  [[nodiscard]] std::string text() const;  ///< one paragraph for a person
};

/// The last lines of a log.
std::string tail_of(const std::filesystem::path& file);

/// What a child has for standard input, output and error, instead of nothing and its log: descriptors of the caller's, and a file.
struct ChildFiles {
  int in = -1, out = -1;
  std::string error = {};  ///< empty: as output
};
/// Starts a program, found as a shell finds it, in the process group `group` (0: its own). `environment`: on top of this process's own;
/// what is empty is left out of it. Throws RunError.
pid_t spawn(const std::vector<std::string>& command, const std::map<std::string, std::string>& environment, const ChildFiles& files,
            pid_t group);
/// What a program says on standard output; nothing if it cannot be started.
std::string said_by(const std::vector<std::string>& command);

class Children {
 public:
  explicit Children(std::filesystem::path log_directory) : log_directory_(std::move(log_directory)) {}
  ~Children();  ///< ends whoever is left: SIGTERM, then SIGKILL after a second
  Children(const Children&) = delete;
  Children& operator=(const Children&) = delete;

  /// Starts `executable arguments...` with stdout and stderr in <log directory>/<name>.log. The child dies with the calling thread's
  /// process. Throws RunError naming the executable and the reason.
  /// `environment`: on top of this process's own. The child's pid.
  pid_t start(const std::string& name, const std::filesystem::path& executable, const std::vector<std::string>& arguments,
              const std::map<std::string, std::string>& environment = {}, ChildFiles files = {});

  /// Sends a signal to the child that was started last under this name, if it lives.
  void signal(const std::string& name, int signal);
  void wake_all() const;              ///< SIGCONT to all that live
  std::optional<Death> next_death();  ///< somebody who ended since the last call; never blocks
  [[nodiscard]] std::size_t alive() const { return alive_; }
  /// Waits until all have ended by themselves or `seconds` have passed; true if all have.
  bool wait_all(double seconds);

 private:
  struct Child {
    std::string name;
    pid_t pid;
    bool ended = false;
  };
  void signal_all(int signal) const;
  std::filesystem::path log_directory_;
  std::vector<Child> children_;
  std::size_t alive_ = 0;
  pid_t group_ = 0;
};

}  // namespace consort
