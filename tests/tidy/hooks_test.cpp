/// The hook that `make hooks` turns on, in a repository of its own.

#include "tests/support/program.hpp"

#include <gtest/gtest.h>

namespace consort {
namespace {

int committed(const Folder& repository, const std::string& text) {
  repository.write("tests/some.cpp", text);
  const std::string hooks = std::string(kSourceDir) + "/deploy/hooks";
  Program git(repository, "/bin/bash",
              {"-c", "cd '" + repository.path().string() + "' && git add tests && git -c core.hooksPath='" + hooks +
                         "' -c user.name=a -c user.email=a@example.org commit -qm some"});
  return git.wait();
}

TEST(Hooks, OnlyWhatIsFormattedIsCommitted) {
  const Folder repository;
  std::filesystem::create_directory(repository.path() / "tests");
  std::filesystem::copy_file(std::string(kSourceDir) + "/.clang-format", repository.path() / ".clang-format");
  Program init(repository, "/usr/bin/env", {"git", "init", "-q", repository.path().string()});
  ASSERT_EQ(init.wait(), 0) << init.err();
  EXPECT_EQ(committed(repository, "int  some( ) ;\n"), 1);
  EXPECT_EQ(committed(repository, "int some();\n"), 0);
}

}  // namespace
}  // namespace consort
