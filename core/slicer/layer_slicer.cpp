// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_slicer.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/material/contone.h"
#include "core/output/encode.h"
#include "core/raster/occupancy.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"

namespace ccslice {
namespace {

// How far outside the limit volume a voxel inside the contours may lie, beyond the contours' own tolerance.
constexpr double kOutsideSlackMm = 1e-3;

LayerLattice lattice_of(const Grid& grid) {
  return {grid.origin_mm.x(), grid.origin_mm.y(),  grid.pitch.x_mm,
          grid.pitch.y_mm,    grid.extent.columns, grid.extent.rows};
}

// The planes of one channel each that a plane is made of; none for the occupancy.
std::vector<PlaneSpec> contone_planes(const PlaneSpec& plane) {
  if (plane.content == PlaneContent::kOccupancy) return {};
  if (plane.content == PlaneContent::kChannel) return {plane};
  std::vector<PlaneSpec> singles(plane.channels.size(), plane);
  for (std::size_t i = 0; i < singles.size(); ++i) {
    singles[i].content = PlaneContent::kChannel;
    singles[i].channel = plane.channels[i];
  }
  return singles;
}

// Planes of floats side by side, voxel by voxel. REQUIRES: planes of the same size, kFloat32.
void interleave(std::span<const ContonePlane> planes, std::vector<std::uint8_t>& samples,
                const CancellationToken& cancel) {
  constexpr std::size_t kSample = sizeof(float), kRun = 1 << 16;
  const std::size_t voxels = planes.front().image().samples.size() / kSample, step = kSample * planes.size();
  samples.resize(step * voxels);
  for (std::size_t begin = 0; begin < voxels; begin += kRun) {
    cancel.throw_if_cancelled();
    const std::size_t end = std::min(voxels, begin + kRun);
    for (std::size_t plane = 0; plane < planes.size(); ++plane) {
      const std::uint8_t* in = planes[plane].image().samples.data();
      std::uint8_t* out = samples.data() + kSample * plane;
      for (std::size_t voxel = begin; voxel < end; ++voxel)
        std::memcpy(out + step * voxel, in + kSample * voxel, kSample);
    }
  }
}

}  // namespace

// What all workers on a job read.
struct LayerSlicer::Shared {
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;
  std::shared_ptr<const ContourIndex> contour_index;
};

struct LayerSlicer::State {
  std::shared_ptr<const Shared> shared;
  const SliceJob& job;
  LayerLattice lattice;
  ContourTracer tracer;
  PlaneEncoder encoder;
  // Of jobs that want a channel:
  std::vector<ContonePlane> contone;  // One a channel of each plane, in the order of the planes.
  std::vector<std::uint8_t> interleaved;
  std::unique_ptr<MaterialField> field;
  std::optional<MaterialPass> materials;

  explicit State(std::shared_ptr<const Shared> the_shared)
      : shared(std::move(the_shared)),
        job(shared->job),
        lattice(lattice_of(job.grid)),
        tracer(*shared->solid, shared->contour_index) {
    const std::vector<ChannelRange>& channels = shared->solid->summary().channels;
    for (const PlaneSpec& plane : job.planes) {
      for (const PlaneSpec& single : contone_planes(plane)) contone.emplace_back(single, channels[single.channel]);
    }
    if (contone.empty()) return;
    field = make_material_field(shared->solid, job.placement, job.contour_tolerance_mm + kOutsideSlackMm);
    materials.emplace(*field);
  }

  Contours trace(double z_mm, const CancellationToken& cancel) {
    SlicePlane plane;
    plane.origin = Vec3(0, 0, z_mm);
    ContourOptions options;
    options.tolerance_mm = job.contour_tolerance_mm;
    options.smallest_feature_mm = std::min(job.grid.pitch.x_mm, job.grid.pitch.y_mm);
    options.cancel = cancel;
    return tracer.trace(plane, options);
  }

  void evaluate_materials(std::span<const Span> spans, Layer& layer, const CancellationToken& cancel) {
    if (!materials) return;
    for (ContonePlane& plane : contone) plane.clear(lattice.width, lattice.height, cancel);
    materials->run(spans, lattice, layer.z_mm, contone, layer.stats, cancel);
  }

  void encode(std::span<const Span> spans, Layer& layer, const CancellationToken& cancel) {
    std::span<const ContonePlane> left = contone;
    BitImage bits;
    for (const PlaneSpec& plane : job.planes) {
      SampleImage image;
      std::vector<std::string> names;
      if (plane.content == PlaneContent::kOccupancy) {
        if (bits.bits.empty()) bits = to_bit_image(spans, lattice.width, lattice.height);
        image = {SampleType::kBit, bits.width, bits.height, bits.bits};
      } else {
        names = channel_names(plane);
        image = contone_image(left.first(names.size()), cancel);
        image.channel_names = names;
        left = left.subspan(names.size());
      }
      layer.planes.push_back(encoder.encode(image, plane.encoding, cancel));
    }
  }

  std::vector<std::string> channel_names(const PlaneSpec& plane) const {
    std::vector<std::string> names;
    for (const PlaneSpec& single : contone_planes(plane)) {
      names.push_back(shared->solid->summary().channels[single.channel].name);
    }
    return names;
  }

  SampleImage contone_image(std::span<const ContonePlane> planes, const CancellationToken& cancel) {
    SampleImage image = planes.front().image();
    if (planes.size() == 1) return image;
    interleave(planes, interleaved, cancel);
    image.samples = interleaved;
    return image;
  }
};

LayerSlicer::LayerSlicer(std::shared_ptr<const LimitSolid> solid, SliceJob job, const CancellationToken& cancel)
    : LayerSlicer([&] {
        auto index = std::make_shared<const ContourIndex>(*solid, job.placement, Vec3::UnitZ(), cancel);
        return std::make_shared<const Shared>(Shared{std::move(solid), std::move(job), std::move(index)});
      }()) {}
LayerSlicer::LayerSlicer(std::shared_ptr<const Shared> shared) : state_(std::make_unique<State>(std::move(shared))) {}
LayerSlicer::~LayerSlicer() = default;
LayerSlicer::LayerSlicer(LayerSlicer&&) noexcept = default;
LayerSlicer& LayerSlicer::operator=(LayerSlicer&&) noexcept = default;

LayerSlicer LayerSlicer::twin() const { return LayerSlicer(state_->shared); }

Layer LayerSlicer::slice(std::uint32_t layer_index, const CancellationToken& cancel) {
  cancel.throw_if_cancelled();
  Layer layer;
  layer.index = layer_index;
  layer.z_mm = state_->job.grid.layer_z_mm(layer_index);
  layer.contours = state_->trace(layer.z_mm, cancel);
  layer.stats.contour_loops = layer.contours.loops.size();
  for (const ContourLoop& loop : layer.contours.loops) layer.stats.contour_points += loop.points.size();
  layer.stats.contour_leaves_unresolved = layer.contours.unresolved_leaves;

  const std::vector<Span> spans = rasterize(layer.contours, state_->lattice);
  for (const Span& span : spans) layer.stats.voxels_inside += span.end - span.begin;
  if (!state_->job.contours) layer.contours = {};
  state_->evaluate_materials(spans, layer, cancel);
  state_->encode(spans, layer, cancel);
  return layer;
}

std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs_of_range(std::uint32_t first, std::uint32_t count) {
  std::vector<std::pair<std::uint32_t, std::uint32_t>> slabs;
  while (count > 0) {
    const std::uint32_t size = std::min(count, kSlabLayers - first % kSlabLayers);
    slabs.emplace_back(first, size);
    first += size;
    count -= size;
  }
  return slabs;
}

}  // namespace ccslice
