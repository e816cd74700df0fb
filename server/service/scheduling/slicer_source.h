// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The slicers of one stream, made within the memory for scratch: what all of them share and the first one are reserved
// beforehand, and each further one when there is room for it and nobody waits for memory. Each gives its part back as
// it goes, the shared part goes with the last of them.

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>

#include "core/slicer/layer_slicer.h"
#include "core/slicer/slicer_memory.h"
#include "server/service/scheduling/layer_stream.h"
#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// Thread-safe.
class SlicerSource : public std::enable_shared_from_this<SlicerSource> {
 public:
  struct Limits {
    std::uint64_t left_bytes = 0;      // Of the budget, which further slicers leave to others.
    std::function<bool()> is_crowded;  // Whether others wait for memory.
  };

  /// `reserved`: of the budget, least_bytes(memory).
  SlicerSource(LayerSlicer prototype, const SlicerMemory& memory, MemoryBudget::Share reserved, Limits limits);

  /// What a stream needs at least.
  static std::uint64_t least_bytes(const SlicerMemory& memory) { return memory.shared_bytes + memory.slicer_bytes; }

  /// How the stream comes by its slicers. They keep the source alive.
  LayerStream::MakeCompute make();
  ComputeLimit limit();

 private:
  class Slicer;

  bool may_add();
  void begin_slicer();
  void end_slicer();
  std::uint64_t wanted_bytes(std::uint64_t slicers) const;

  const SlicerMemory memory_;
  const Limits limits_;
  std::mutex mutex_;           // Guards what follows, but for the prototype.
  MemoryBudget::Share share_;  // Goes after the prototype.
  std::uint64_t slicers_ = 0;
  std::uint64_t promised_ = 1;  // Reserved, but not made yet.
  const LayerSlicer prototype_;
};

}  // namespace ccslice::server
