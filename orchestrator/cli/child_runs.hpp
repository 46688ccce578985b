#pragma once
/// `consort` in processes of its own, several at once; none survives this one.

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace consort {

struct ChildAnswer {
  int exit = 0;          ///< 128 + signal, where one ended it
  std::string out, err;  ///< what it said; err only where it was kept
  double seconds = 0.0;
};

struct ChildOptions {
  std::size_t jobs = 1;              ///< at most so many at once
  bool keep_err = true;              ///< else standard error is this program's
  std::function<bool()> go_on = {};  ///< asked before each; false: no further one is started
};

/// Runs `consort ARGUMENTS` for each entry and tells of each as it ends. SIGINT, SIGTERM and SIGHUP go on to all that run, no further one
/// is started, and the number is returned when they have ended; 0: none came. Throws RunError if a process cannot be started.
int run_children(std::span<const std::vector<std::string>> commands, const ChildOptions& options,
                 const std::function<void(std::size_t, const ChildAnswer&)>& ended);

}  // namespace consort
