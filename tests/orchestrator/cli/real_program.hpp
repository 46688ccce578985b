#pragma once
/// A test that runs the real `consort` in a folder of its own.

#include "tests/support/program.hpp"

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

namespace consort {

class RealProgram : public testing::Test {
 protected:
  [[nodiscard]] std::string at(const std::string& name) const { return (folder_.path() / name).string(); }
  /// Its exit code; what it has said is in `out_` and `err_`.
  int consort(std::vector<std::string> arguments) {
    Program program(folder_, "consort", std::move(arguments));
    const int code = program.wait();
    out_ = program.out();
    err_ = program.err();
    return code;
  }

  Folder folder_;
  std::string out_, err_;
};

}  // namespace consort
