// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/heap_trim.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace ccslice::server {
namespace {

constexpr std::uint64_t kWorthIt = 64u << 20;
constexpr std::uint64_t kWorthItWhenIdle = 8u << 20;

std::uint64_t unknown_bytes(const HeapTrim::Figures& figures) {
  return figures.resident_bytes - std::min(figures.resident_bytes, figures.known_bytes);
}

}  // namespace

std::uint64_t resident_memory_bytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t pages = 0, resident = 0;
  file >> pages >> resident;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

bool HeapTrim::sweep() {
  if (!is_worth_it(figures_())) return false;
  malloc_trim(0);
  base_bytes_ = unknown_bytes(figures_());
  trimmed_ = Clock::now();
  return true;
}

bool HeapTrim::is_worth_it(const Figures& now) {
  const bool is_much = now.freed_bytes - seen_bytes_ >= kWorthIt;
  if (is_much || again_) {
    again_ = is_much;
    seen_bytes_ = now.freed_bytes;
    return true;
  }
  base_bytes_ = std::min(base_bytes_, unknown_bytes(now));
  const std::uint64_t least = now.is_idle ? kWorthItWhenIdle : kWorthIt;
  return unknown_bytes(now) - base_bytes_ >= least && (!trimmed_ || Clock::now() - *trimmed_ >= pause_);
}

}  // namespace ccslice::server
