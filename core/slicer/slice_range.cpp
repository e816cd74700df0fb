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
#include "core/slicer/layer_slicer.h"

namespace ccslice {

void validate_layer_range(const SliceJob& job, std::uint32_t first, std::uint32_t count) {
  if (count == 0) throw Error(ErrorCode::kLayerRangeEmpty, "layer_count: 0; ask for at least one layer", "layer_count");
  const VoxelRegion region = region_of(job);
  const bool starts_within = first >= region.first_layer && first < region.end_layer();
  if (starts_within && std::uint64_t{first} + count <= region.end_layer()) return;
  throw Error(ErrorCode::kLayerRangeOutOfBounds,
              "first_layer, layer_count: layers " + std::to_string(first) + " to " +
                  std::to_string(std::uint64_t{first} + count - 1) + " are beyond the " +
                  (job.region ? "region's, " : "grid's, ") + std::to_string(region.first_layer) + " to " +
                  std::to_string(region.end_layer() - 1),
              starts_within ? "layer_count" : "first_layer");
}

void slice_range(const PlacedParts& parts, std::uint32_t first, std::uint32_t count,
                 const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options) {
  validate_layer_range(parts.front().job, first, count);
  tbb::task_arena arena(options.threads > 0 ? options.threads : tbb::task_arena::automatic);
  const LayerSlicer prototype(parts, options.cancel);
  tbb::enumerable_thread_specific<LayerSlicer> slicers([&] { return prototype.twin(); });
  const auto slabs = slabs_of_range(first, count);
  // Layers in flight live here: the pipeline would leak what it holds when a stage throws.
  std::vector<std::vector<Layer>> window(static_cast<std::size_t>(arena.max_concurrency()) + 1);
  const auto slot = [&](std::size_t slab) -> std::vector<Layer>& { return window[slab % window.size()]; };
  std::size_t next = 0;
  const auto number_slabs = [&](tbb::flow_control& control) {
    if (next == slabs.size()) control.stop();
    return next == slabs.size() ? next : next++;
  };
  const auto slice_slab = [&](std::size_t slab) {
    const auto [first_layer, layers] = slabs[slab];
    LayerSlicer& slicer = slicers.local();
    for (std::uint32_t k = 0; k < layers; ++k) slot(slab).push_back(slicer.slice(first_layer + k, options.cancel));
    return slab;
  };
  const auto deliver = [&](std::size_t slab) {
    for (Layer& layer : slot(slab)) on_layer(std::move(layer));
    slot(slab).clear();
  };
  arena.execute([&] {
    using tbb::filter_mode;
    tbb::parallel_pipeline(window.size(),
                           tbb::make_filter<void, std::size_t>(filter_mode::serial_in_order, number_slabs) &
                               tbb::make_filter<std::size_t, std::size_t>(filter_mode::parallel, slice_slab) &
                               tbb::make_filter<std::size_t, void>(filter_mode::serial_in_order, deliver));
  });
}

void slice_range(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job, std::uint32_t first,
                 std::uint32_t count, const std::function<void(Layer&&)>& on_layer, const SliceRangeOptions& options) {
  slice_range(PlacedParts{{"", solid, job}}, first, count, on_layer, options);
}

}  // namespace ccslice
