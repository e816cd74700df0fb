// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slice_range.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <string>
#include <utility>
#include <vector>

#include "core/base/error.h"

namespace ccslice {

void validate_layer_range(const Grid& grid, std::uint32_t first, std::uint32_t count) {
  if (count == 0) throw Error(ErrorCode::kLayerRangeEmpty, "layer_count: 0; ask for at least one layer", "layer_count");
  if (std::uint64_t{first} + count <= grid.extent.layers) return;
  throw Error(ErrorCode::kLayerRangeOutOfBounds,
              "first_layer + layer_count: " + std::to_string(std::uint64_t{first} + count) + " is beyond the grid's " +
                  std::to_string(grid.extent.layers) + " layers",
              first >= grid.extent.layers ? "first_layer" : "layer_count");
}

void slice_range(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job, std::uint32_t first,
                 std::uint32_t count, const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options) {
  validate_layer_range(job.grid, first, count);
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  const LayerSlicer prototype(solid, job, options.cancel);
  tbb::enumerable_thread_specific<LayerSlicer> slicers([&] { return prototype.twin(); });
  // Layers in flight live here: the pipeline would leak what it holds when a stage throws.
  std::vector<Layer> window(2 * static_cast<std::size_t>(arena.max_concurrency()));
  const auto slot = [&](std::uint32_t offset) -> Layer& { return window[offset % window.size()]; };
  std::uint32_t next = 0;
  const auto number_layers = [&](tbb::flow_control& control) {
    if (next == count) control.stop();
    return next == count ? next : next++;
  };
  const auto slice_layer = [&](std::uint32_t offset) {
    slot(offset) = slicers.local().slice(first + offset, options.cancel);
    return offset;
  };
  const auto deliver = [&](std::uint32_t offset) { on_layer(std::move(slot(offset))); };
  arena.execute([&] {
    using tbb::filter_mode;
    tbb::parallel_pipeline(window.size(),
                           tbb::make_filter<void, std::uint32_t>(filter_mode::serial_in_order, number_layers) &
                               tbb::make_filter<std::uint32_t, std::uint32_t>(filter_mode::parallel, slice_layer) &
                               tbb::make_filter<std::uint32_t, void>(filter_mode::serial_in_order, deliver));
  });
}

}  // namespace ccslice
