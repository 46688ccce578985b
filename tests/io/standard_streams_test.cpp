/// What cannot be written must not end a program: each case in a child process of its own, whose streams are made unwritable.

#include "io/standard_streams.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <functional>
#include <string>

namespace consort {
namespace {

/// The exit code of a child that runs `spoil`, then writes as a program does and ends with `code`; 1000 + signal. `told`: its standard
/// error, unless `spoil` takes it.
int ends_with(const std::function<void()>& spoil, int code, std::string* told = nullptr, std::size_t length = 10) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  const pid_t child = fork();
  if (child == 0) {
    dup2(ends[1], STDERR_FILENO);
    close(ends[0]);
    close(ends[1]);
    spoil();
    streams::prepare();
    streams::tell("progress\n");
    streams::put(std::string(length, 'x'));
    streams::put("more");
    _exit(streams::concluded("program", code));
  }
  close(ends[1]);
  std::array<char, 4096> buffer{};
  for (ssize_t n = 0; (n = read(ends[0], buffer.data(), buffer.size())) > 0;)
    if (told) told->append(buffer.data(), static_cast<std::size_t>(n));
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  return WIFSIGNALED(status) ? 1000 + WTERMSIG(status) : WEXITSTATUS(status);
}

void onto(const char* file, int descriptor) { dup2(open(file, O_WRONLY), descriptor); }

void onto_pipe_without_reader() {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) _exit(99);
  dup2(ends[1], STDOUT_FILENO);
  close(ends[0]);
}

TEST(StandardStreams, WhatIsLostOfStandardOutputIsExitCodeThreeWithTheReason) {
  const std::array<std::pair<std::function<void()>, const char*>, 3> cases{
      {{[] { onto("/dev/full", STDOUT_FILENO); }, "No space left on device"},
       {[] { close(STDOUT_FILENO); }, "Bad file descriptor"},
       {onto_pipe_without_reader, "Broken pipe"}}};
  for (const auto& [spoil, reason] : cases) {
    for (const int code : {0, 1}) {
      std::string told;
      EXPECT_EQ(ends_with(spoil, code, &told), 3) << reason;
      EXPECT_NE(told.find(reason), std::string::npos) << told;
    }
    EXPECT_EQ(ends_with(spoil, 2), 2) << "a failure keeps its own code";
    EXPECT_EQ(ends_with(spoil, 130), 130);
  }
}

TEST(StandardStreams, AnUnwritableStandardErrorChangesNothing) {
  const auto quiet = [](const std::function<void()>& spoil) {
    return [spoil] {
      onto("/dev/null", STDOUT_FILENO);
      spoil();
    };
  };
  for (const int code : {0, 1, 3}) {
    EXPECT_EQ(ends_with(quiet([] { close(STDERR_FILENO); }), code), code);
    EXPECT_EQ(ends_with(quiet([] { onto("/dev/full", STDERR_FILENO); }), code), code);
  }
}

TEST(StandardStreams, ALimitOnTheSizeOfFilesIsAnErrorAndNoSignal) {
  std::string told;
  const auto limit = [] {
    std::string name = "/tmp/consort-streams-XXXXXX";
    const int file = mkstemp(name.data());
    unlink(name.c_str());
    dup2(file, STDOUT_FILENO);
    const rlimit size{4096, 4096};
    setrlimit(RLIMIT_FSIZE, &size);
  };
  EXPECT_EQ(ends_with(limit, 0, &told, 100'000), 3);
  EXPECT_NE(told.find("File too large"), std::string::npos) << told;
}

TEST(StandardStreams, ADescriptorNobodyGaveIsNotGivenToAFile) {
  const pid_t child = fork();
  if (child == 0) {
    for (int descriptor = 0; descriptor < 3; ++descriptor) close(descriptor);
    streams::prepare();
    _exit(open("/dev/null", O_RDONLY) > 2 ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

}  // namespace
}  // namespace consort
