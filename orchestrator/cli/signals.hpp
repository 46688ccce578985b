#pragma once
/// The signals that end a run.

#include "core/errors.hpp"

#include <atomic>

namespace consort {

/// From now on SIGINT, SIGTERM and SIGHUP (as SIGTERM, and unless it was ignored: nohup) are kept instead of ending the program.
void catch_signals();
/// The one that came; 0: none. The drivers look at it.
const std::atomic<int>& caught_signal();
Exit interrupted_exit(int signal);

}  // namespace consort
