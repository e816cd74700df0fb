// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far the preparation of a solid is: the step that it is at, and how many items of the step are done. Items are
// counted as they are done, on whatever threads do them. No share of time follows from that: steps and items take
// different times.

#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace ccslice {

/// In their order. Those up to kReading are for whoever brings the mesh.
enum class PreparationStep : std::uint8_t {
  kWaiting,    // For its turn. Not counted.
  kReading,    // The mesh's bytes. Not counted.
  kChecking,   // The mesh's rules, with its complex. Not counted.
  kRefining,   // Cells that are looked at, and refined where that is needed. Not counted.
  kBuilding,   // Limit cells with their rings and operators.
  kMeasuring,  // The boundary: its box, volumes. Not counted.
  kBounding,   // Boxes of limit cells.
  kFolding,    // Limit cells that are searched for folds.
  kFinishing,  // What is kept near folds, and where parts overlap. Not counted.
};
inline constexpr std::size_t kPreparationSteps = 9;

/// One thread begins the steps; any threads count, and any look on.
class PreparationProgress {
 public:
  struct State {
    PreparationStep step = PreparationStep::kWaiting;
    std::uint64_t done = 0;
    std::uint64_t total = 0;  // 0: the step isn't counted.
  };

  /// REQUIRES: a step behind the last one.
  void begin(PreparationStep step, std::uint64_t total = 0) noexcept {
    counts_[static_cast<std::size_t>(step)].total.store(total, std::memory_order_relaxed);
    step_.store(step, std::memory_order_release);
  }
  /// Counts items of the step that began last. REQUIRES: no more than its total in all.
  void add(std::uint64_t items) noexcept {
    const auto step = static_cast<std::size_t>(step_.load(std::memory_order_relaxed));
    counts_[step].done.fetch_add(items, std::memory_order_relaxed);
  }
  /// Never before what an earlier call on the same thread gave.
  State state() const noexcept {
    const PreparationStep step = step_.load(std::memory_order_acquire);
    const Count& count = counts_[static_cast<std::size_t>(step)];
    return {step, count.done.load(std::memory_order_relaxed), count.total.load(std::memory_order_relaxed)};
  }

 private:
  struct Count {
    std::atomic<std::uint64_t> done{0}, total{0};
  };

  std::atomic<PreparationStep> step_{PreparationStep::kWaiting};
  std::array<Count, kPreparationSteps> counts_;
};

}  // namespace ccslice
