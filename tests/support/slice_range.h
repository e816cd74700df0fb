// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers of a range on several threads, by the stream that servers slice with
// (server/service/scheduling/layer_stream.h).

#pragma once

#include <cstdint>
#include <functional>
#include <memory>

#include "core/base/cancellation.h"
#include "core/job/placed_part.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

struct SliceRangeOptions {
  int threads = 0;  // DEFAULT: 0, as many as there are processors.
  CancellationToken cancel;
};

/// Calls `on_layer` for layers [first, first + count), one at a time, in order. At most a slab a thread and one more
/// are in flight. REQUIRES: PlacedParts. Throws what slicing throws (kCancelled included), what `on_layer` throws, and
/// what validate_layer_range() throws.
void slice_range(const PlacedParts& parts, std::uint32_t first, std::uint32_t count,
                 const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options = {});
/// The same of a job of one part. REQUIRES: validate_job(*solid, job) passes.
void slice_range(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job, std::uint32_t first,
                 std::uint32_t count, const std::function<void(Layer&&)>& on_layer,
                 const SliceRangeOptions& options = {});

}  // namespace ccslice
