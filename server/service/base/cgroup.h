// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How much of the machine this process may use: the smallest of what the machine has, the affinity mask, and the limits
// of its cgroup and all cgroups above it (versions 1 and 2). Inside a container the path that /proc names may be that
// of the host, so the root of the mount counts too.

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>

namespace ccslice::server {

struct Resources {
  std::size_t cpus = 1;  // At least 1; fractions of a CPU round up.
  std::uint64_t memory_bytes = 0;
};

/// Limits of the cgroups alone, below `root` ("/" or a test's imitation): `unlimited` where nothing is limited.
Resources cgroup_resources(const std::filesystem::path& root, const Resources& unlimited);

/// The resources that this process may use.
Resources available_resources();

}  // namespace ccslice::server
