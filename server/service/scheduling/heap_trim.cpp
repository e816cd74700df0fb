// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/heap_trim.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

namespace ccslice::server {
namespace {

constexpr std::uint64_t kWorthIt = 64u << 20;
constexpr std::uint64_t kWorthItWhenIdle = 8u << 20;
// With 1 MiB a thread that slices gives back and faults in the same pages all the time: a seventh more time.
constexpr int kKeptByThread = 4 << 20, kMappedAlone = 4 << 20;

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

std::uint64_t free_heap_bytes() { return mallinfo2().fordblks; }

// glibc's malloc_trim() gives back what lies free in between, but of a thread's own heap not the free end. That shrinks
// when something large is freed there and the end is longer than M_TRIM_THRESHOLD, which by itself grows up to 64 MiB
// (arena.c: heap_trim(); malloc.c: free()): with a thread for each processor that can be gigabytes. To set either of
// the two thresholds fixes both. Blocks above M_MMAP_THRESHOLD are mapped one by one: they leave nothing behind, but
// their pages are faulted in each time.
void bound_kept_memory() {
  mallopt(M_TRIM_THRESHOLD, kKeptByThread);
  mallopt(M_MMAP_THRESHOLD, kMappedAlone);
}

bool HeapTrim::sweep() {
  if (!is_worth_it(figures_())) return false;
  trim();
  return true;
}

void HeapTrim::trim() {
  const bool was_idle = figures_().is_idle;
  malloc_trim(0);
  free_at_trim_ = free_bytes_();
  const Figures after = figures_();
  base_bytes_ = unknown_bytes(after);
  if (was_idle && after.is_idle) idle_base_bytes_ = base_bytes_;
  trimmed_ = Clock::now();
}

bool HeapTrim::is_worth_it(const Figures& now) {
  const bool is_much = now.freed_bytes - seen_bytes_ >= kWorthIt;
  if (is_much || again_) {
    again_ = is_much;
    seen_bytes_ = now.freed_bytes;
    return true;
  }
  const std::uint64_t unknown = unknown_bytes(now);
  for (std::uint64_t* base : {&base_bytes_, &idle_base_bytes_}) *base = std::min(*base, unknown);
  if (now.is_idle) {
    const std::uint64_t free_bytes = free_bytes_();
    free_at_trim_ = std::min(free_at_trim_, free_bytes);  // Some of it may have been used again since.
    return unknown - idle_base_bytes_ >= kWorthItWhenIdle || free_bytes >= free_at_trim_ + kWorthItWhenIdle;
  }
  return unknown - base_bytes_ >= kWorthIt && (!trimmed_ || Clock::now() - *trimmed_ >= pause_);
}

}  // namespace ccslice::server
