// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The memory that preparations of meshes hold together, and who waits for it. What a preparation takes shows only as it
// goes on. One that finds none while others hold it gives back what it has, waits, and is begun anew once all that it
// asked for has been taken for it: two that kept a half each would wait for one another for ever.
//
// Preparations that wait are begun in their order, but whoever fits passes one that doesn't. One that has waited for
// long is passed no more by its like. LARGE ones, which take more than an eighth of all, leave an eighth to the small
// ones, unless they couldn't be prepared then; and while a large one has waited for long, the small ones have no more
// than that together. So small ones needn't wait for the end of a large one, nor large ones for a time without small
// ones.

#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <vector>

#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// Thread-safe.
class PreparationMemory {
 public:
  static constexpr std::chrono::milliseconds kLongWait{10'000};

  /// The budget outlives this, and has no other users.
  explicit PreparationMemory(MemoryBudget& budget, std::chrono::milliseconds long_wait = kLongWait)
      : budget_(budget), long_wait_(long_wait) {}

  /// What one preparation holds, or waits for. Given back with the object, which waits no more then.
  class Share {
   public:
    explicit Share(PreparationMemory& memory) : memory_(memory), held_(memory.budget_) {}
    ~Share();
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

    std::uint64_t bytes() const;
    /// Takes more, or gives some back. False, with nothing changed, if others hold it or come first.
    [[nodiscard]] bool resize(std::uint64_t bytes);
    /// Gives all back, and takes `bytes` as soon as that may be. Then `begin` runs, on any thread, without locks.
    /// REQUIRES: at most the budget's capacity; doesn't wait.
    void wait(std::uint64_t bytes, std::function<void()> begin);

   private:
    friend class PreparationMemory;
    PreparationMemory& memory_;
    MemoryBudget::Share held_;
    // While it waits:
    std::uint64_t wanted_bytes_ = 0;
    std::chrono::steady_clock::time_point since_;
    std::function<void()> begin_;
  };

  /// What a preparation throws that has to wait: for the share that is its own, to have so many bytes.
  struct Lack {
    std::shared_ptr<Share> share;
    std::uint64_t bytes;
  };

  /// How many preparations wait.
  std::size_t waiting() const;

 private:
  using Clock = std::chrono::steady_clock;

  std::uint64_t small_bytes() const { return budget_.capacity_bytes() / 8; }
  bool is_large(std::uint64_t bytes) const { return bytes > small_bytes(); }
  std::uint64_t left_by(std::uint64_t bytes) const;
  std::uint64_t used_by_small_besides(const Share& share) const;
  bool has_to_wait_locked(const Share& share, std::uint64_t bytes) const;
  bool resize_locked(Share& share, std::uint64_t bytes);
  std::vector<std::function<void()>> begin_locked();

  MemoryBudget& budget_;
  const std::chrono::milliseconds long_wait_;
  mutable std::mutex mutex_;  // Guards the shares, too.
  std::list<Share*> waiting_;
  std::uint64_t small_used_bytes_ = 0;  // By small ones.
};

}  // namespace ccslice::server
