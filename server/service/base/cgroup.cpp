// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/base/cgroup.h"

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

namespace ccslice::server {
namespace {

namespace fs = std::filesystem;

/// A line of /proc/self/cgroup: "id:controllers:path". Version 2 has id 0 and no controllers.
struct Membership {
  std::vector<std::string> controllers;
  fs::path path;  // Relative to the mount.
};

std::vector<Membership> read_memberships(const fs::path& root) {
  std::vector<Membership> memberships;
  std::ifstream file(root / "proc/self/cgroup");
  for (std::string line; std::getline(file, line);) {
    const std::size_t first = line.find(':');
    const std::size_t second = first == std::string::npos ? first : line.find(':', first + 1);
    if (second == std::string::npos) continue;
    Membership membership;
    std::istringstream controllers(line.substr(first + 1, second - first - 1));
    for (std::string name; std::getline(controllers, name, ',');) membership.controllers.push_back(name);
    membership.path = fs::path(line.substr(second + 1)).relative_path();
    memberships.push_back(std::move(membership));
  }
  return memberships;
}

/// The folders of a cgroup and of all above it, up to the mount.
std::vector<fs::path> with_ancestors(const fs::path& mount, const fs::path& path) {
  std::vector<fs::path> folders{mount};
  fs::path folder = mount;
  for (const fs::path& part : path) {
    if (part.empty() || part == "..") break;
    folder /= part;
    folders.push_back(folder);
  }
  return folders;
}

std::optional<double> read_number(const fs::path& path) {
  std::ifstream file(path);
  double number = 0;
  if (!(file >> number)) return std::nullopt;  // Absent, or "max".
  return number;
}

void limit_cpus(Resources& resources, double quota, double period) {
  if (!(quota > 0) || !(period > 0)) return;  // -1: none.
  const double cpus = quota / period;
  const auto whole = static_cast<std::size_t>(std::min(cpus, 1e6) + 0.999);
  resources.cpus = std::min(resources.cpus, std::max<std::size_t>(1, whole));
}

void limit_memory(Resources& resources, std::optional<double> bytes) {
  if (!bytes || !(*bytes > 0) || *bytes >= 9.2e18) return;
  resources.memory_bytes = std::min(resources.memory_bytes, static_cast<std::uint64_t>(*bytes));
}

void apply_v2(Resources& resources, const fs::path& folder) {
  std::ifstream file(folder / "cpu.max");
  double quota = 0;
  double period = 0;
  if (file >> quota >> period) limit_cpus(resources, quota, period);  // "max" isn't a number.
  limit_memory(resources, read_number(folder / "memory.max"));
}

void apply_v1(Resources& resources, const std::string& controller, const fs::path& folder) {
  if (controller == "cpu") {
    limit_cpus(resources, read_number(folder / "cpu.cfs_quota_us").value_or(-1),
               read_number(folder / "cpu.cfs_period_us").value_or(-1));
  } else if (controller == "memory") {
    limit_memory(resources, read_number(folder / "memory.limit_in_bytes"));
  }
}

}  // namespace

Resources cgroup_resources(const fs::path& root, const Resources& unlimited) {
  const fs::path mount = root / "sys/fs/cgroup";
  Resources resources = unlimited;
  for (const Membership& membership : read_memberships(root)) {
    if (membership.controllers.empty()) {
      for (const fs::path& folder : with_ancestors(mount, membership.path)) apply_v2(resources, folder);
      continue;
    }
    for (const std::string& controller : membership.controllers) {
      for (const fs::path& folder : with_ancestors(mount / controller, membership.path)) {
        apply_v1(resources, controller, folder);
      }
    }
  }
  return resources;
}

Resources available_resources() {
  cpu_set_t affinity;
  CPU_ZERO(&affinity);
  Resources machine;
  if (sched_getaffinity(0, sizeof affinity, &affinity) == 0) {
    machine.cpus = static_cast<std::size_t>(std::max(1, CPU_COUNT(&affinity)));
  }
  machine.memory_bytes =
      static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
  return cgroup_resources("/", machine);
}

}  // namespace ccslice::server
