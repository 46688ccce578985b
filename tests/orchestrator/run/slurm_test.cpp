/// The nodes of a Slurm allocation, as its environment says them.

#include "orchestrator/run/slurm.hpp"

#include "core/errors.hpp"
#include "tests/support/program.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

namespace consort {
namespace {

TEST(Slurm, SaysTasksOfItsNodesInShort) {
  EXPECT_EQ(tasks_per_node("V", "2(x3),1"), (std::vector<std::size_t>{2, 2, 2, 1}));
  EXPECT_EQ(tasks_per_node("V", "8"), (std::vector<std::size_t>{8}));
  for (const char* wrong : {"2(x", "x", "0", "2(x3", "2(x1000000000000)", "-1"})
    EXPECT_THROW(tasks_per_node("V", wrong), ConfigError) << wrong;
}

TEST(Slurm, NodesAreHostsWithAsManySlotsAsTasks) {
  const Folder folder;
  chmod(folder.write("scontrol", "#!/bin/sh\n[ \"$3\" = 'n[1-2]' ] && printf 'n1\\nn2\\n'\n").c_str(), 0755);
  const std::string path = std::getenv("PATH");
  setenv("PATH", (folder.path().string() + ":" + path).c_str(), 1);
  setenv("SLURM_JOB_NODELIST", "n[1-2]", 1);
  setenv("SLURM_TASKS_PER_NODE", "3(x2)", 1);
  const auto hosts = hosts_of_allocation();
  setenv("PATH", path.c_str(), 1);
  unsetenv("SLURM_JOB_NODELIST");
  unsetenv("SLURM_TASKS_PER_NODE");
  ASSERT_EQ(hosts.size(), 2u);
  EXPECT_EQ(hosts[1].name, "n2");
  EXPECT_EQ(hosts[1].launcher, Launcher::slurm);
  EXPECT_EQ(hosts[1].slots, 3u);
  EXPECT_THROW(hosts_of_allocation(), ConfigError) << "outside an allocation";
}

}  // namespace
}  // namespace consort
