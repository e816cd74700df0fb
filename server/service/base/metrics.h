// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the server counts for those who watch it. Labels are bounded: methods and reasons of the contract, never meshes
// or clients.

#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <utility>

namespace ccslice::server {

/// Durations, by how many are at most so long. Thread-safe.
class DurationHistogram {
 public:
  /// Seconds.
  static constexpr std::array kBounds = {0.001, 0.005, 0.02, 0.1, 0.5, 2.0, 10.0, 60.0, 300.0, 1800.0};

  struct Counts {
    std::array<std::uint64_t, kBounds.size() + 1> in{};  // Each between two bounds; the last above all.
    std::uint64_t all = 0;
    double sum_s = 0;
  };

  void add(std::chrono::nanoseconds duration);
  [[nodiscard]] Counts counts() const;

 private:
  std::array<std::atomic<std::uint64_t>, kBounds.size() + 1> in_{};
  std::atomic<std::uint64_t> sum_ns_{0};
};

/// Calls that have ended, by method and by reason ("OK" where none failed). Thread-safe.
class CallCounts {
 public:
  using Key = std::pair<std::string, std::string>;

  void add(const std::string& method, const std::string& reason);
  [[nodiscard]] std::map<Key, std::uint64_t> counts() const;

 private:
  mutable std::mutex mutex_;
  std::map<Key, std::uint64_t> counts_;
};

struct Metrics {
  CallCounts calls;
  DurationHistogram seconds_for_place;       // Waits of calls, also those that ended in a refusal: for a place among
  DurationHistogram seconds_for_memory;      // the running ones, and for memory to work in.
  DurationHistogram seconds_to_first_layer;  // From the begin of a SliceRange.
  DurationHistogram seconds_in_all;          // Of all calls but previews and points, whose clients decide, and polls.
  std::atomic<std::uint64_t> layers{0}, voxels{0}, layer_bytes{0};  // Layers on their way to clients.
  std::atomic<std::uint64_t> shed{0};                               // Calls that gave back what they held,
  std::atomic<std::uint64_t> gave_way{0};                           // or gave it to another client.
  std::atomic<std::uint64_t> preview_pictures{0};
};

}  // namespace ccslice::server
