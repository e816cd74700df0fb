// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/slicer_source.h"

#include <algorithm>
#include <utility>

namespace ccslice::server {

/// A slicer and its part of the memory.
class SlicerSource::Slicer {
 public:
  explicit Slicer(std::shared_ptr<SlicerSource> source) : counted_(std::move(source)), slicer_(counted_.twin()) {}

  Layer slice(std::uint32_t layer, const CancellationToken& cancel) { return slicer_.slice(layer, cancel); }

 private:
  /// Outlives the slicer, since its part is given back only when it has gone.
  class Counted {
   public:
    explicit Counted(std::shared_ptr<SlicerSource> source) : source_(std::move(source)) { source_->begin_slicer(); }
    ~Counted() { source_->end_slicer(); }
    Counted(const Counted&) = delete;
    Counted& operator=(const Counted&) = delete;
    LayerSlicer twin() const { return source_->prototype_.twin(); }

   private:
    std::shared_ptr<SlicerSource> source_;
  };

  Counted counted_;
  LayerSlicer slicer_;
};

SlicerSource::SlicerSource(LayerSlicer prototype, const SlicerMemory& memory, MemoryBudget::Share reserved,
                           Limits limits)
    : memory_(memory), limits_(std::move(limits)), share_(std::move(reserved)), prototype_(std::move(prototype)) {}

LayerStream::MakeCompute SlicerSource::make() {
  return [self = shared_from_this()](const CancellationToken&) {
    return [slicer = std::make_shared<Slicer>(self)](std::uint32_t layer, const CancellationToken& cancel) {
      return slicer->slice(layer, cancel);
    };
  };
}

ComputeLimit SlicerSource::limit() {
  return {.may_add = [self = shared_from_this()] { return self->may_add(); }, .is_crowded = limits_.is_crowded};
}

bool SlicerSource::may_add() {
  if (limits_.is_crowded()) return false;
  const std::lock_guard lock(mutex_);
  if (!share_.resize(wanted_bytes(slicers_ + promised_ + 1), limits_.left_bytes)) return false;
  ++promised_;
  return true;
}

void SlicerSource::begin_slicer() {
  const std::lock_guard lock(mutex_);
  ++slicers_;
  if (promised_ > 0) --promised_;
}

void SlicerSource::end_slicer() {
  MemoryBudget::Share given_back;  // After the lock: whoever waits for it may begin on this thread.
  const std::lock_guard lock(mutex_);
  --slicers_;
  given_back = share_.split_off_beyond(wanted_bytes(slicers_ + promised_));
}

std::uint64_t SlicerSource::wanted_bytes(std::uint64_t slicers) const {
  return memory_.shared_bytes + std::max<std::uint64_t>(1, slicers) * memory_.slicer_bytes;
}

}  // namespace ccslice::server
