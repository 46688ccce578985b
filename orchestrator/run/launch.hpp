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
  std::string log_tail;                    ///< last lines of its log
  [[nodiscard]] std::string text() const;  ///< one paragraph for a person
};

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
              const std::map<std::string, std::string>& environment = {});

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

/// A block of UDP ports nobody else uses, reserved as long as the object lives (advisory lock files keep concurrent runs apart).
class PortBlock {
 public:
  /// Throws RunError saying how many ports were wanted and where it looked.
  explicit PortBlock(std::size_t ports);
  ~PortBlock();
  PortBlock(const PortBlock&) = delete;
  PortBlock& operator=(const PortBlock&) = delete;
  [[nodiscard]] std::uint16_t first() const { return first_; }

 private:
  bool reserve(std::size_t unit, std::size_t units, std::size_t ports);
  void release();
  std::vector<int> locks_;
  std::uint16_t first_ = 0;
};

/// Says who else on this host uses the well-known ports of a DDS domain, by lock files beside those of the port blocks.
class DomainShare {
 public:
  DomainShare() = default;
  ~DomainShare();
  DomainShare(const DomainShare&) = delete;
  DomainShare& operator=(const DomainShare&) = delete;
  /// From now on, until it ends, this one does. Where no lock can be had, nobody is known to.
  void enter(unsigned domain);
  /// Does anybody else now?
  [[nodiscard]] bool with_others() const;

 private:
  int lock_ = -1;
};

/// What tells runs of one name, key and domain apart on a host: there is one of them at a time. Their processes would take part in both.
class SoleRun {
 public:
  /// Throws ConfigError that names the other one's pid.
  SoleRun(const std::string& name, const std::string& key, unsigned domain);
  ~SoleRun();
  SoleRun(const SoleRun&) = delete;
  SoleRun& operator=(const SoleRun&) = delete;

 private:
  int socket_ = -1;
};

}  // namespace consort
