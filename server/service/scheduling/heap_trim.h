// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Gives memory that was freed back to the machine. The allocator keeps what lies between pieces still in use, for each
// thread that allocated; looking for it there takes some milliseconds, so it is done now and then: after much has been
// freed; where the process holds far more than anybody knows of, as messages and what gRPC makes of them count nowhere;
// and when nothing runs any more. The allocator is asked then, too, since nobody else knows what gRPC has freed.

#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <utility>

namespace ccslice::server {

/// What the process holds of the machine's memory; 0 if nobody knows.
[[nodiscard]] std::uint64_t resident_memory_bytes();

/// What the allocator holds of what was freed, given back to the machine or not. Takes some time.
[[nodiscard]] std::uint64_t free_heap_bytes();

/// Bounds what each thread keeps of what it frees, which trimming can't reach. To be called before there are threads.
void bound_kept_memory();

/// One thread.
class HeapTrim {
 public:
  struct Figures {
    std::uint64_t freed_bytes = 0;  // Since the beginning, or about to be. About.
    std::uint64_t known_bytes = 0;  // That somebody says he holds.
    std::uint64_t resident_bytes = 0;
    bool is_idle = false;  // Nothing runs.
  };

  /// `pause`: between two sweeps that trim for what nobody knows of, while something runs.
  explicit HeapTrim(std::function<Figures()> figures, std::chrono::milliseconds pause = std::chrono::seconds(5),
                    std::function<std::uint64_t()> free_bytes = &free_heap_bytes)
      : figures_(std::move(figures)), pause_(pause), free_bytes_(std::move(free_bytes)), free_at_trim_(free_bytes_()) {}

  /// To be called now and then. Whether it was worth it.
  bool sweep();
  /// Gives back what there is, whether or not it was worth it.
  void trim();

 private:
  using Clock = std::chrono::steady_clock;

  bool is_worth_it(const Figures& now);

  const std::function<Figures()> figures_;
  const std::chrono::milliseconds pause_;
  const std::function<std::uint64_t()> free_bytes_;
  std::uint64_t free_at_trim_;  // Given back to the machine.
  std::uint64_t seen_bytes_ = 0;
  bool again_ = false;  // What was about to be freed then has been by now.
  /// The least that was held beyond what is known: programs, libraries, what trimming can't give back.
  std::uint64_t base_bytes_ = std::numeric_limits<std::uint64_t>::max();
  /// The least that was held so when nothing ran: without what calls held when it trimmed beside them.
  std::uint64_t idle_base_bytes_ = std::numeric_limits<std::uint64_t>::max();
  std::optional<Clock::time_point> trimmed_;
};

}  // namespace ccslice::server
