// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/cgroup.h"

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;

/// A file tree that imitates / as far as cgroups go.
class Cgroup : public ::testing::Test {
 protected:
  Cgroup() : root_(fs::path(::testing::TempDir()) / ("cgroup_test_" + std::to_string(::getpid()))) {
    fs::remove_all(root_);
  }
  ~Cgroup() override { fs::remove_all(root_); }

  void write(const std::string& path, const std::string& text) {
    const fs::path full = root_ / path;
    fs::create_directories(full.parent_path());
    std::ofstream(full) << text;
  }

  Resources read() const { return cgroup_resources(root_, machine_); }

  const Resources machine_{.cpus = 16, .memory_bytes = 64ull << 30};
  fs::path root_;
};

TEST_F(Cgroup, WithoutAnyLimitIsTheMachine) {
  write("proc/self/cgroup", "0::/\n");
  write("sys/fs/cgroup/cpu.max", "max 100000\n");
  write("sys/fs/cgroup/memory.max", "max\n");
  EXPECT_EQ(read().cpus, 16u);
  EXPECT_EQ(read().memory_bytes, 64ull << 30);
}

TEST_F(Cgroup, WithoutAnyFilesIsTheMachine) { EXPECT_EQ(read().cpus, 16u); }

TEST_F(Cgroup, Version2InAContainerLimitsBoth) {
  write("proc/self/cgroup", "0::/\n");
  write("sys/fs/cgroup/cpu.max", "250000 100000\n");
  write("sys/fs/cgroup/memory.max", "1073741824\n");
  EXPECT_EQ(read().cpus, 3u) << "2.5 CPUs round up";
  EXPECT_EQ(read().memory_bytes, 1ull << 30);
}

TEST_F(Cgroup, Version2OnAHostTakesTheSmallestOfAllAncestors) {
  write("proc/self/cgroup", "0::/system.slice/ccsliced.service\n");
  write("sys/fs/cgroup/system.slice/cpu.max", "200000 100000\n");
  write("sys/fs/cgroup/system.slice/ccsliced.service/cpu.max", "800000 100000\n");
  write("sys/fs/cgroup/system.slice/memory.max", "8589934592\n");
  write("sys/fs/cgroup/system.slice/ccsliced.service/memory.max", "4294967296\n");
  EXPECT_EQ(read().cpus, 2u);
  EXPECT_EQ(read().memory_bytes, 4ull << 30);
}

TEST_F(Cgroup, Version1LimitsBoth) {
  write("proc/self/cgroup", "5:memory:/docker/abc\n4:cpu,cpuacct:/docker/abc\n");
  write("sys/fs/cgroup/cpu/docker/abc/cpu.cfs_quota_us", "50000\n");
  write("sys/fs/cgroup/cpu/docker/abc/cpu.cfs_period_us", "100000\n");
  write("sys/fs/cgroup/memory/docker/abc/memory.limit_in_bytes", "536870912\n");
  EXPECT_EQ(read().cpus, 1u);
  EXPECT_EQ(read().memory_bytes, 512ull << 20);
}

TEST_F(Cgroup, Version1InAContainerFindsTheLimitsAtTheMount) {
  write("proc/self/cgroup", "5:memory:/docker/of-the-host\n4:cpu,cpuacct:/docker/of-the-host\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "400000\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "2147483648\n");
  EXPECT_EQ(read().cpus, 4u);
  EXPECT_EQ(read().memory_bytes, 2ull << 30);
}

TEST_F(Cgroup, Version1WithoutLimitsHasAMinusOneAndAHugeNumber) {
  write("proc/self/cgroup", "5:memory:/\n4:cpu,cpuacct:/\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_quota_us", "-1\n");
  write("sys/fs/cgroup/cpu/cpu.cfs_period_us", "100000\n");
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_EQ(read().cpus, 16u);
  EXPECT_EQ(read().memory_bytes, 64ull << 30);
}

TEST(AvailableResources, AreAtLeastOneCpuAndSomeMemory) {
  EXPECT_GE(available_resources().cpus, 1u);
  EXPECT_GE(available_resources().memory_bytes, 1ull << 20);
}

}  // namespace
}  // namespace ccslice::server
