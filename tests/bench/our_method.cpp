// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/bench/our_method.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>

#include "core/contour/contour_index.h"
#include "tests/bench/clocks.h"

namespace ccslice::bench {
namespace {

constexpr double kOutsideMm = 2e-3;  // As LayerSlicer has it with the default contour tolerance.

ContonePlane channel_plane(const LimitSolid& solid, std::uint32_t channel, SampleType type) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.sample_type = type;
  return {plane, solid.summary().channels.at(channel), channel};
}

std::vector<ChannelTolerance> channel_tolerances(const LimitSolid& solid, double share, std::uint32_t count) {
  std::vector<ChannelTolerance> tolerances;
  for (std::uint32_t c = 0; c < count; ++c) {
    const ChannelRange& channel = solid.summary().channels.at(c);
    tolerances.push_back({c, share * (channel.max - channel.min)});
  }
  return tolerances;
}

}  // namespace

std::uint64_t count_voxels(std::span<const VoxelRun> spans) {
  std::uint64_t voxels = 0;
  for (const VoxelRun& span : spans) voxels += span.end - span.begin;
  return voxels;
}

OurMethod::OurMethod(const PrinterJob& job, double tolerance, std::uint32_t channels)
    : job_(job),
      lattice_(job.job.grid.lattice()),
      tracer_(*job.solid, std::make_shared<const ContourIndex>(*job.solid, job.job.placement, Vec3::UnitZ())),
      field_(make_material_field(job.solid, job.job.placement, kOutsideMm)),
      slabs_(job.solid, *field_,
             {job.job.placement, job.job.grid, channel_tolerances(*job.solid, tolerance, channels), kOutsideMm,
              job.job.prove_channels}),
      bytes_(channel_plane(*job.solid, 0, SampleType::kUint8)) {
  for (std::uint32_t c = 0; c < channels; ++c) floats_.push_back(channel_plane(*job.solid, c, SampleType::kFloat32));
}

Contours OurMethod::trace(std::uint32_t layer) {
  SlicePlane plane;
  plane.origin = Vec3(0, 0, job_.job.grid.layer_z_mm(layer));
  ContourOptions options;
  options.tolerance_mm = job_.job.contour_tolerance_mm;
  options.smallest_feature_mm = std::min(lattice_.dx_mm, lattice_.dy_mm);
  return tracer_.trace(plane, options);
}

LayerShape OurMethod::shape(std::uint32_t layer, StageCost& cost) {
  LayerShape result;
  result.layer = layer;
  result.z_mm = job_.job.grid.layer_z_mm(layer);
  result.contours = timed(cost.contour_ns, [&] { return trace(layer); });
  timed(cost.raster_ns, [&] {
    result.spans = rasterize(result.contours, lattice_);
    return to_bit_image(result.spans, lattice_.width, lattice_.height);
  });
  result.voxels = count_voxels(result.spans);
  ++cost.layers;
  cost.voxels += result.voxels;
  return result;
}

std::vector<LayerShape> OurMethod::shape_slab(std::uint32_t first_layer, StageCost& cost) {
  std::vector<LayerShape> slab;
  const std::uint32_t end = std::min(first_layer + kSlabLayers, job_.job.grid.extent.layers);
  for (std::uint32_t layer = first_layer; layer < end; ++layer) slab.push_back(shape(layer, cost));
  return slab;
}

void OurMethod::solve_materials(std::span<const LayerShape> slab) {
  slab_ = slab;
  slabs_.start(slab.front().layer, slab.back().layer + 1);
}

void OurMethod::run_materials(std::span<const LayerShape> slab, StageCost& cost) {
  timed(cost.material_ns, [&] {
    solve_materials(slab);
    for (const LayerShape& shape : slab) paint(shape, bytes_);
  });
}

SampleImage OurMethod::paint_bytes(const LayerShape& shape) {
  paint(shape, bytes_);
  return bytes_.image();
}

std::vector<float> OurMethod::values(const LayerShape& shape, std::uint32_t channel) {
  paint(shape, floats_.at(channel));
  const std::span<const std::uint8_t> samples = floats_[channel].image().samples;
  std::vector<float> values(samples.size() / sizeof(float));
  std::memcpy(values.data(), samples.data(), samples.size());
  return values;
}

void OurMethod::paint(const LayerShape& shape, ContonePlane& plane) {
  plane.clear(lattice_.width, lattice_.height);
  const CancellationToken never;
  const LayerWindow all = window_of(lattice_);
  const WindowOutcome outcome = slabs_.paint(
      {lattice_, shape.z_mm, {&plane, 1}, stats_, never, all, all}, shape.layer,
      [&](std::uint32_t layer) { return std::span<const VoxelRun>(slab_[layer - slab_.front().layer].spans); });
  if (outcome != WindowOutcome::kComplete) throw std::logic_error("the window is the whole layer");
}

}  // namespace ccslice::bench
