// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_slicer.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/material/contone.h"
#include "core/output/encode.h"
#include "core/raster/occupancy.h"
#include "core/slicer/halftone_pass.h"
#include "core/slicer/material_field.h"
#include "core/slicer/material_pass.h"
#include "core/slicer/slab_materials.h"

namespace ccslice {
namespace {

// How far outside the limit volume a voxel inside the contours may lie, beyond the contours' own tolerance.
constexpr double kOutsideSlackMm = 1e-3;

// The planes of one channel each that a plane is made of; none for the occupancy.
std::vector<PlaneSpec> contone_planes(const PlaneSpec& plane) {
  if (plane.content == PlaneContent::kChannel) return {plane};
  if (plane.content != PlaneContent::kChannels) return {};
  std::vector<PlaneSpec> singles(plane.channels.size(), plane);
  for (std::size_t i = 0; i < singles.size(); ++i) {
    singles[i].content = PlaneContent::kChannel;
    singles[i].channel = plane.channels[i];
  }
  return singles;
}

std::vector<PlaneSpec> all_contone_planes(const SliceJob& job) {
  std::vector<PlaneSpec> all;
  for (const PlaneSpec& plane : job.planes) {
    const std::vector<PlaneSpec> singles = contone_planes(plane);
    all.insert(all.end(), singles.begin(), singles.end());
  }
  return all;
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

bool shows_materials(const SliceJob& job) {
  return std::any_of(job.planes.begin(), job.planes.end(), [](const PlaneSpec& plane) {
    return plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask;
  });
}

// The planes that halftoning reads: the channels of the material map as floats.
std::vector<PlaneSpec> mixed_planes(const SliceJob& job) {
  std::vector<PlaneSpec> planes;
  if (!shows_materials(job)) return planes;
  for (const std::uint32_t channel : channels_of(job.printing->map)) {
    PlaneSpec& plane = planes.emplace_back();
    plane.content = PlaneContent::kChannel;
    plane.channel = channel;
    plane.sample_type = SampleType::kFloat32;
  }
  return planes;
}

double default_material_tolerance(SampleType type) { return type == SampleType::kUint8 ? 1.0 / 1024 : 1.0 / 65536; }

/// The strictest tolerance of each channel that some plane shows or is made of.
class ToleranceList {
 public:
  ToleranceList(const SliceJob& job, std::span<const ChannelRange> channels) : job_(job), channels_(channels) {
    for (const PlaneSpec& plane : all_contone_planes(job)) {
      const double span = plane.range ? plane.range->max - plane.range->min : std::numeric_limits<double>::infinity();
      add(plane.channel, span, default_material_tolerance(plane.sample_type));
    }
    for (const PlaneSpec& plane : mixed_planes(job)) {
      add(plane.channel, steepest_span(job.printing->map), default_material_tolerance(SampleType::kUint8));
    }
  }
  std::vector<ChannelTolerance> take() { return std::move(list_); }

 private:
  void add(std::uint32_t index, double span, double default_share) {
    const ChannelRange& channel = channels_[index];
    const double share = job_.material_tolerance.value_or(default_share);
    // Of a constant channel: what rounding leaves.
    const double rounding = 1e-9 * std::max({std::abs(channel.min), std::abs(channel.max), 1e-30});
    const double tolerance = std::max(share * std::min(span, channel.max - channel.min), rounding);
    const auto known =
        std::find_if(list_.begin(), list_.end(), [&](const ChannelTolerance& c) { return c.channel == index; });
    if (known == list_.end()) {
      list_.push_back({index, tolerance});
    } else {
      known->tolerance = std::min(known->tolerance, tolerance);
    }
  }

  const SliceJob& job_;
  std::span<const ChannelRange> channels_;
  std::vector<ChannelTolerance> list_;
};

}  // namespace

namespace {

/// What of a layer is worked on, for a region of it.
struct LayerScope {
  RowRange rows;       // Whose voxels are found and solved,
  LayerWindow window;  // what is made of them,
  LayerWindow region;  // and what is delivered.
};

LayerScope whole_scope(const SliceJob& job) {
  return {{0, job.grid.extent.rows}, window_of(job.grid.lattice()), region_of(job).window()};
}

LayerScope scope_of(const SliceJob& job) {
  LayerScope scope{{}, region_of(job).window(), region_of(job).window()};
  // Errors come from all voxels before.
  if (shows_materials(job) && job.printing->halftone.method == HalftoneMethod::kErrorDiffusion) {
    scope.window = {0, 0, job.grid.extent.columns, scope.region.end_row()};
  }
  const std::uint32_t last_block = (scope.window.end_row() - 1) / kRowsTogether;
  scope.rows.begin = scope.window.first_row - scope.window.first_row % kRowsTogether;
  scope.rows.end = std::min((last_block + 1) * kRowsTogether, job.grid.extent.rows);
  return scope;
}

}  // namespace

VoxelRegion region_of(const SliceJob& job) { return job.region.value_or(whole_region(job.grid)); }

// What all workers on a job read.
struct LayerSlicer::Shared {
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;
  std::shared_ptr<const ContourIndex> contour_index;
  std::optional<HalftonePlan> halftone;  // Of jobs that show materials.
  std::shared_ptr<PieceStore> pieces;
};

/// The contours of a layer, and what is inside them.
struct LayerShape {
  Contours contours;  // Only if the job delivers them.
  std::vector<Span> spans;
  LayerStats stats;
};

struct LayerSlicer::State {
  std::shared_ptr<const Shared> shared;
  const SliceJob& job;
  LayerLattice lattice;
  LayerScope scope;
  ContourTracer tracer;
  PlaneEncoder encoder;
  // Of jobs that want a channel:
  std::vector<ContonePlane> contone;  // One a channel of each plane, in the order of the planes,
  std::size_t shown_contone = 0;      // so many; then those that halftoning reads.
  std::optional<HalftonePass> halftone;
  std::vector<std::uint8_t> interleaved, arranged;
  std::unique_ptr<MaterialField> field;
  std::optional<MaterialPass> materials;  // Every voxel inverted, or ...
  std::optional<SlabMaterials> slabs;     // ... interpolated, slab by slab.
  std::uint32_t slab_first = 0;
  std::vector<std::optional<LayerShape>> slab;  // Those of its layers that were met.
  std::unique_ptr<State> whole;                 // For layers of a region that need others of their voxels.

  State(std::shared_ptr<const Shared> the_shared, const LayerScope& the_scope)
      : shared(std::move(the_shared)),
        job(shared->job),
        lattice(job.grid.lattice()),
        scope(the_scope),
        tracer(*shared->solid, shared->contour_index) {
    const std::vector<ChannelRange>& channels = shared->solid->summary().channels;
    for (const PlaneSpec& plane : all_contone_planes(job)) contone.emplace_back(plane, channels[plane.channel]);
    shown_contone = contone.size();
    for (const PlaneSpec& plane : mixed_planes(job)) contone.emplace_back(plane, channels[plane.channel]);
    if (shared->halftone) halftone.emplace(*shared->halftone);
    if (contone.empty()) return;
    const double outside_mm = job.contour_tolerance_mm + kOutsideSlackMm;
    field = make_material_field(shared->solid, job.placement, outside_mm);
    if (job.material_tolerance == 0) {
      materials.emplace(*field);
    } else {
      const InterpolationSpec spec{job.placement, job.grid, ToleranceList(job, channels).take(), outside_mm};
      slabs.emplace(shared->solid, *field, spec, shared->pieces, scope.rows);
    }
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

  LayerShape shape(std::uint32_t layer, const CancellationToken& cancel) {
    LayerShape result;
    result.contours = trace(job.grid.layer_z_mm(layer), cancel);
    result.spans = rasterize(result.contours, lattice, scope.rows);
    if (scope.region != window_of(lattice)) drop_loops_outside(scope.region, lattice, result.contours);
    result.stats.contour_loops = result.contours.loops.size();
    for (const ContourLoop& loop : result.contours.loops) result.stats.contour_points += loop.points.size();
    result.stats.contour_leaves_unresolved = result.contours.unresolved_leaves;
    for (const Span& span : result.spans) {
      const Span part = scope.region.clipped(span);
      result.stats.voxels_inside += part.end - part.begin;
    }
    if (!job.contours) result.contours = {};
    return result;
  }

  /// Interpolation works on whole slabs, whatever the range that is asked for.
  void enter_slab(std::uint32_t layer) {
    const std::uint32_t first = layer - layer % kSlabLayers;
    if (!slab.empty() && slab_first == first) return;
    slab.clear();
    const std::uint32_t end = std::min(first + kSlabLayers, job.grid.extent.layers);
    slabs->start(first, end);
    slab.resize(end - first);
    slab_first = first;
  }

  const LayerShape& shape_in_slab(std::uint32_t layer, const CancellationToken& cancel) {
    std::optional<LayerShape>& known = slab[layer - slab_first];
    if (!known) known = shape(layer, cancel);
    return *known;
  }

  /// False if the window alone can't say all.
  bool evaluate_materials(std::span<const Span> spans, Layer& layer, const CancellationToken& cancel) {
    for (ContonePlane& plane : contone) plane.clear(scope.window.columns, scope.window.rows, cancel);
    const LayerTarget target{lattice, layer.z_mm, contone, layer.stats, cancel, scope.window, scope.region};
    if (materials) return materials->run(target, spans);
    return !slabs || slabs->paint(target, layer.index, [&](std::uint32_t k) {
      return std::span<const Span>(shape_in_slab(k, cancel).spans);
    });
  }

  void choose_materials(std::span<const Span> spans, Layer& layer, const CancellationToken& cancel) {
    if (!halftone) return;
    halftone->run({lattice, layer.index, layer.z_mm, scope.window, scope.region}, spans,
                  std::span(contone).subspan(shown_contone), cancel);
    layer.stats.material_voxels = halftone->histogram();
  }

  Arrangement arrangement() const { return {scope.window, scope.region, job.order}; }

  void encode(std::span<const Span> spans, Layer& layer, const CancellationToken& cancel) {
    std::span<const ContonePlane> left = std::span(contone).first(shown_contone);
    BitImage bits;
    std::vector<std::uint8_t> indices;
    const IndexImage materials_image = halftone ? index_image(indices, cancel) : IndexImage{};
    for (const PlaneSpec& plane : job.planes) {
      if (plane.content == PlaneContent::kMaterials) {
        layer.planes.push_back(encoder.encode(materials_image, plane.sample_type, plane.encoding, cancel));
        continue;
      }
      if (plane.content == PlaneContent::kMaterialMask) {
        layer.planes.push_back(encoder.encode_mask(materials_image, plane.material, plane.encoding, cancel));
        continue;
      }
      SampleImage image;
      std::vector<std::string> names;
      if (plane.content == PlaneContent::kOccupancy) {
        if (bits.bits.empty()) bits = arranged_bits(spans, arrangement());
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

  IndexImage index_image(std::vector<std::uint8_t>& indices, const CancellationToken& cancel) const {
    IndexImage image = halftone->image();
    image.indices = arrange(image.indices, 1, arrangement(), indices, cancel);
    image.width = scope.region.columns;
    image.height = scope.region.rows;
    return image;
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
    if (planes.size() > 1) {
      interleave(planes, interleaved, cancel);
      image.samples = interleaved;
    }
    const std::size_t bytes = sample_bytes(image.type, 1, 1, static_cast<std::uint32_t>(planes.size()));
    image.samples = arrange(image.samples, bytes, arrangement(), arranged, cancel);
    image.width = scope.region.columns;
    image.height = scope.region.rows;
    return image;
  }

  Layer slice(std::uint32_t index, const CancellationToken& cancel) {
    cancel.throw_if_cancelled();
    Layer layer;
    layer.index = index;
    layer.z_mm = job.grid.layer_z_mm(index);
    if (slabs) enter_slab(index);
    LayerShape own;
    if (!slabs) own = shape(index, cancel);
    const LayerShape& shape = slabs ? shape_in_slab(index, cancel) : own;
    layer.stats = shape.stats;
    layer.contours = shape.contours;
    if (!evaluate_materials(shape.spans, layer, cancel)) {
      if (!whole) whole = std::make_unique<State>(shared, whole_scope(job));
      return whole->slice(index, cancel);
    }
    choose_materials(shape.spans, layer, cancel);
    encode(shape.spans, layer, cancel);
    return layer;
  }
};

LayerSlicer::LayerSlicer(std::shared_ptr<const LimitSolid> solid, SliceJob job, const CancellationToken& cancel)
    : LayerSlicer([&] {
        auto index = std::make_shared<const ContourIndex>(*solid, job.placement, Vec3::UnitZ(), cancel);
        std::optional<HalftonePlan> halftone;
        const VoxelPitch& pitch = job.grid.pitch;
        if (shows_materials(job)) halftone.emplace(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm, cancel);
        return std::make_shared<const Shared>(
            Shared{std::move(solid), std::move(job), std::move(index), std::move(halftone), make_piece_store()});
      }()) {}
LayerSlicer::LayerSlicer(std::shared_ptr<const Shared> shared)
    : state_([&] {
        const LayerScope scope = scope_of(shared->job);
        return std::make_unique<State>(std::move(shared), scope);
      }()) {}
LayerSlicer::~LayerSlicer() = default;
LayerSlicer::LayerSlicer(LayerSlicer&&) noexcept = default;
LayerSlicer& LayerSlicer::operator=(LayerSlicer&&) noexcept = default;

LayerSlicer LayerSlicer::twin() const { return LayerSlicer(state_->shared); }

Layer LayerSlicer::slice(std::uint32_t layer, const CancellationToken& cancel) { return state_->slice(layer, cancel); }

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
