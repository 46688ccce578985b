#pragma once
/// A real program run by a test: output in files, ended by pid, never left behind.

#include "tests/support/text_of.hpp"
#include "tests/support/tree.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace consort {

/// Waits on a condition, looking every few milliseconds; false once `seconds` have passed. Generous limits cost nothing when all is well.
inline bool eventually(const std::function<bool()>& condition, double seconds = 120) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    poll(nullptr, 0, 5);
  }
  return true;
}

/// A folder of the test's own, removed with it.
class Folder {
 public:
  Folder() {
    std::string pattern = (std::filesystem::temp_directory_path() / "consort-test-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(path_ / name) << text;
    return path_ / name;
  }

 private:
  std::filesystem::path path_;
};

class Program {
 public:
  Program(const Folder& folder, const std::string& name, std::vector<std::string> arguments) : name_(name) {
    static int number = 0;
    out_ = folder.path() / (std::to_string(++number) + ".out");
    err_ = folder.path() / (std::to_string(number) + ".err");
    arguments.insert(arguments.begin(), name.starts_with("/") ? name : std::string(kBinDir) + "/" + name);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    pid_ = fork();
    if (pid_ != 0) return;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    dup2(open("/dev/null", O_RDONLY), 0);
    dup2(open(out_.c_str(), O_WRONLY | O_CREAT, 0644), 1);
    dup2(open(err_.c_str(), O_WRONLY | O_CREAT, 0644), 2);
    execv(argv[0], argv.data());
    _exit(127);
  }
  ~Program() {
    if (status_) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  /// Exit code, or 1000 + signal. Fails the test and kills the program after `seconds`.
  int wait(double seconds = 240) {
    const bool ended = eventually([&] { return over(); }, seconds);
    if (!ended) {
      ADD_FAILURE() << name_ << " did not end within " << seconds << " s; stderr:\n" << err();
      kill(pid_, SIGKILL);
      int status = 0;
      waitpid(pid_, &status, 0);
      status_ = status;
    }
    return WIFSIGNALED(*status_) ? 1000 + WTERMSIG(*status_) : WEXITSTATUS(*status_);
  }
  bool over() {
    int status = 0;
    if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) status_ = status;
    return status_.has_value();
  }
  void signal(int number) const { kill(pid_, number); }
  [[nodiscard]] pid_t pid() const { return pid_; }
  [[nodiscard]] std::string out() const { return text_of(out_); }
  [[nodiscard]] std::string err() const { return text_of(err_); }
  /// Pids of its live children.
  [[nodiscard]] std::vector<pid_t> children() const {
    std::ifstream in("/proc/" + std::to_string(pid_) + "/task/" + std::to_string(pid_) + "/children");
    std::vector<pid_t> pids;
    for (pid_t pid = 0; in >> pid;) pids.push_back(pid);
    return pids;
  }

 private:
  std::string name_;
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  std::optional<int> status_;
};

/// Does a process with this pid run (a zombie does not)?
inline bool runs(pid_t pid) {
  std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
  std::string text((std::istreambuf_iterator<char>(in)), {});
  const auto end = text.rfind(')');
  return end != std::string::npos && end + 2 < text.size() && text[end + 2] != 'Z';
}

}  // namespace consort
