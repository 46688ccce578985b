#include "orchestrator/script/input_file.hpp"

#include "core/errors.hpp"
#include "orchestrator/script/script.hpp"
#include "tests/orchestrator/folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fstream>
#include <thread>

namespace consort {
namespace {

using namespace std::chrono_literals;

std::string refusal_of(const std::filesystem::path& file, std::size_t most = 100) {
  try {
    read_input(file, most, 20ms);
    return "";
  } catch (const ConfigError& error) {
    return error.what();
  }
}

TEST(InputFile, WhatIsNoFileIsRefusedByItsKind) {
  const ScratchFolder folder;
  EXPECT_EQ(refusal_of("/dev/zero"), "is a device; allowed: a file, or a pipe");
  EXPECT_EQ(refusal_of(folder.path()), "is a folder; allowed: a file, or a pipe");
  EXPECT_EQ(refusal_of(folder.path() / "absent"), "cannot be read (No such file or directory); allowed: a file, or a pipe");
}

TEST(InputFile, SizeIsBounded) {
  const ScratchFolder folder;
  std::ofstream(folder.path() / "f") << std::string(100, 'a');
  EXPECT_EQ(read_input(folder.path() / "f", 100), std::string(100, 'a'));
  EXPECT_EQ(refusal_of(folder.path() / "f", 99), "holds more than 99 bytes; allowed: at most so many");
}

TEST(InputFile, APipeIsReadToItsEndAndNotWaitedForForEver) {
  const ScratchFolder folder;
  const auto pipe = folder.path() / "pipe";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(refusal_of(pipe).find("is a pipe that gave nothing for 0.02 s"), std::string::npos);
  std::thread writer([&pipe] { std::ofstream(pipe) << std::string(1'000'000, 'a'); });
  EXPECT_EQ(read_input(pipe, 2'000'000, 30s).size(), 1'000'000u);
  writer.join();
}

TEST(InputFile, ExperimentsAndTheirDataFilesAreReadWithinBounds) {
  const ScratchFolder folder;
  const auto told = [&folder](const std::string& data) {
    try {
      parse_experiment("experiment: e\nagents: {count: 2, protocol: local_voting, initial: {x: {file: " + data + "}}}\ntopology: ring\n",
                       "e.yaml", folder.path());
      return std::string();
    } catch (const ConfigError& error) {
      return std::string(error.what());
    }
  };
  const std::string place = "e.yaml:2:64: agents.initial.x.file: found '";
  EXPECT_EQ(told("/dev/zero"), place + "/dev/zero', which is a device; allowed: a file, or a pipe beside the experiment");
  EXPECT_EQ(told("/").find(place + "/', which is a folder"), 0u);
  EXPECT_EQ(told("absent").find(place + "absent', which cannot be read (No such file"), 0u);
  std::ofstream(folder.path() / "marked.csv") << "\xef\xbb\xbf"
                                                 "4\n5\n";
  EXPECT_EQ(told("marked.csv"), "");
  std::ofstream(folder.path() / "nul.csv") << "4\n5" << '\0' << "\n";
  std::ofstream(folder.path() / "wide.csv") << [] {
    std::string line = "1";
    for (int i = 0; i < 20'000; ++i) line += ",1";
    return line + "\n2\n";
  }();
  EXPECT_EQ(told("wide.csv"),
            (folder.path() / "wide.csv").string() + ":1:20001: found more than 10000 numbers in a line; allowed: at most 10000");
  EXPECT_EQ(told("nul.csv"), (folder.path() / "nul.csv").string() + ":2:1: found '5\\x00'; allowed: a finite number");
  std::ofstream(folder.path() / "many.csv") << [] {
    std::string text;
    for (int i = 0; i < 1000; ++i) text += "a\n";
    return text;
  }();
  EXPECT_NE(told("many.csv").find("... and 950 more"), std::string::npos);
  const auto repeated = [](const char* line) {
    std::string text;
    for (int i = 0; i < 100'000; ++i) text += line;
    return text;
  };
  std::ofstream(folder.path() / "long.csv") << repeated("4\n");
  EXPECT_NE(told("long.csv").find("found 100000 lines in 'long.csv'; allowed: 2, one per agent"), std::string::npos);
  std::ofstream(folder.path() / "wrong.csv") << repeated("a\n");
  EXPECT_NE(told("wrong.csv").find("... and 9950 more"), std::string::npos) << "no more than so many are looked for";
  try {
    load_experiment("/dev/zero");
    ADD_FAILURE() << "read";
  } catch (const ConfigError& error) {
    EXPECT_STREQ(error.what(), "/dev/zero: is a device; allowed: a file, or a pipe");
  }
}

}  // namespace
}  // namespace consort
