// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/part_painter.h"

#include <algorithm>
#include <utility>

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/field/material_field.h"
#include "core/field/material_pass.h"
#include "core/field/source_pass.h"
#include "core/interpolation/pieces/cell_node_store.h"
#include "core/interpolation/slab_materials.h"
#include "core/interpolation/tiles/tile_trials.h"
#include "core/raster/occupancy.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/cut.h"
#include "core/slicer/halftone_pass.h"
#include "core/slicer/layer_scope.h"
#include "core/slicer/part_planes.h"

namespace ccslice {

struct PartPainter::Shared {
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;
  std::shared_ptr<const ContourIndex> contour_index;
  std::shared_ptr<const HalftonePlan> halftone;  // Present if the job shows materials.
  std::shared_ptr<CellNodeStore> pieces;
};

struct PartPainter::State {
  std::shared_ptr<const Shared> shared;
  const SliceJob& job;
  LayerLattice lattice;
  LayerScope scope;
  ContourTracer tracer;
  PartPlanes planes;
  std::optional<HalftonePass> halftone;
  // Present if the job wants one of the solid's channels:
  std::unique_ptr<MaterialField> field;
  std::optional<MaterialPass> materials;  // If every voxel is inverted.
  std::optional<SlabMaterials> slabs;     // If materials are interpolated, slab by slab.
  SourcePass sources;                     // Of the other channels.
  std::uint32_t slab_first = 0;
  std::vector<std::optional<PartShape>> slab;  // Those of its layers that were met.
  PartShape own;                               // That of the layer at hand, if there are no slabs.
  PartShape remaining;                         // What the job leaves of it, if it cuts.
  std::unique_ptr<State> whole;                // For layers of a region that need others of their voxels.

  State(std::shared_ptr<const Shared> the_shared, const LayerScope& the_scope)
      : shared(std::move(the_shared)),
        job(shared->job),
        lattice(job.grid.lattice()),
        scope(the_scope),
        tracer(*shared->solid, shared->contour_index),
        planes(job, shared->solid->summary()),
        sources(used_sources(job), planes.specs(), job.placement) {
    const LayerWindow most = common_window(whole_bytes(window_of_solid(shared->solid->summary(), job)), scope.window);
    planes.reserve(most);
    if (shared->halftone) halftone.emplace(*shared->halftone, std::size_t{most.columns} * most.rows);
    if (!planes.need_solid()) return;
    field = make_material_field(shared->solid, job.placement, outside_mm_of(job));
    if (job.channel_tolerance == 0) {
      materials.emplace(*field);
    } else {
      const InterpolationSpec spec = interpolation_spec_of(job, shared->solid->summary().channels);
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

  bool mixes_by_region() const { return halftone && !job.printing->cell_region_maps.empty(); }

  std::vector<RegionRun> cell_regions(const PartShape& shape, const CancellationToken& cancel) const {
    const LimitSolid& solid = *shared->solid;
    if (solid.has_several_regions()) {
      return find_regions(shape.contours.region_edges, shape.spans, lattice, scope.rows, cancel);
    }
    std::vector<RegionRun> runs;
    for (const VoxelRun& span : shape.spans) runs.push_back({span, solid.region_of(ControlCellId{0})});
    return runs;
  }

  std::vector<RegionLoop> region_loops(const Contours& contours, const CancellationToken& cancel) const {
    if (shared->solid->has_several_regions()) return join_region_loops(contours.region_edges, cancel);
    std::vector<RegionLoop> loops;
    for (const ContourLoop& loop : contours.loops) {
      RegionLoop& made = loops.emplace_back(RegionLoop{shared->solid->region_of(ControlCellId{0}), {}});
      for (const ContourPoint& point : loop.points) made.points.push_back(point.xy);
    }
    return loops;
  }

  PartShape shape(std::uint32_t layer, const CancellationToken& cancel) {
    PartShape result;
    result.contours = trace(job.grid.layer_z_mm(layer), cancel);
    result.spans = rasterize(result.contours, lattice, scope.rows, cancel);
    if (shows_cell_regions(job) || mixes_by_region()) result.regions = cell_regions(result, cancel);
    if (job.contours_by_cell_region) result.region_loops = region_loops(result.contours, cancel);
    result.contours.region_edges = {};
    if (scope.region != window_of(lattice)) {
      drop_loops_outside(scope.region, lattice, result.contours.loops);
      drop_loops_outside(scope.region, lattice, result.region_loops);
    }
    result.stats.contour_loops = result.contours.loops.size();
    for (const ContourLoop& loop : result.contours.loops) result.stats.contour_points += loop.points.size();
    result.stats.contour_leaves_unresolved = result.contours.unresolved_leaves;
    for (const VoxelRun& span : result.spans) {
      const VoxelRun part = scope.region.clipped(span);
      result.stats.voxels_inside += part.end - part.begin;
    }
    if (!job.contours || job.contours_by_cell_region) result.contours = {};
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

  const PartShape& shape_in_slab(std::uint32_t layer, const CancellationToken& cancel) {
    std::optional<PartShape>& known = slab[layer - slab_first];
    if (!known) known = shape(layer, cancel);
    return *known;
  }

  WindowOutcome evaluate_channels(std::uint32_t layer, PaintedPart& part, const CancellationToken& cancel) {
    planes.start(part.window, cancel);
    const double z_mm = job.grid.layer_z_mm(layer);
    const bool is_whole = scope.window == window_of(lattice);
    const LayerTarget target{lattice, z_mm, planes.channels(), part.stats, cancel, part.window, scope.region, is_whole};
    auto outcome = WindowOutcome::kComplete;
    if (materials) outcome = materials->run(target, part.shape->spans);
    if (slabs) {
      outcome = slabs->paint(
          target, layer, [&](std::uint32_t k) { return std::span<const VoxelRun>(shape_in_slab(k, cancel).spans); });
    }
    if (outcome == WindowOutcome::kComplete) sources.run(target, part.shape->spans);
    return outcome;
  }

  /// Leaves out what the job cuts.
  void cut(PaintedPart& part, const CancellationToken& cancel) {
    if (!job.cut) return;
    remaining = *part.shape;
    std::uint64_t voxels = 0;
    const auto count = [&](const VoxelRun& run) {
      const VoxelRun counted = scope.region.clipped(run);
      voxels += counted.end - counted.begin;
    };
    cut_part(planes, part.window, remaining.spans, remaining.regions, count, cancel);
    part.shape = &remaining;
    part.stats.voxels_inside -= voxels;
    part.stats.voxels_cut = voxels;
  }

  void choose_materials(std::uint32_t layer, PaintedPart& part, const CancellationToken& cancel) {
    if (!halftone) return;
    const HalftonePass::Place place{lattice, layer, job.grid.layer_z_mm(layer), part.window, scope.region};
    if (mixes_by_region()) {
      halftone->run(place, part.shape->regions, planes.mixed(), cancel);
    } else {
      halftone->run(place, part.shape->spans, planes.mixed(), cancel);
    }
    part.materials = halftone->image();
    part.halftone = shared->halftone.get();
    part.mixed = planes.mixed();
    part.stats.material_voxels = halftone->histogram();
    part.stats.voxels_off_map = halftone->misfits().off_map;
    part.stats.voxels_scaled_up = halftone->misfits().scaled_up;
    if (part.stats.voxels_scaled_up > 0) part.stats.least_fraction_sum = halftone->misfits().least_sum;
  }

  PaintedPart paint(std::uint32_t layer, const CancellationToken& cancel) {
    cancel.throw_if_cancelled();
    if (slabs) {
      enter_slab(layer);
    } else {
      own = shape(layer, cancel);
    }
    PaintedPart part;
    part.shape = slabs ? &shape_in_slab(layer, cancel) : &own;
    part.window = common_window(whole_bytes(window_of(part.shape->spans)), scope.window);
    part.planes = planes.shown();
    part.stats = part.shape->stats;
    if (evaluate_channels(layer, part, cancel) == WindowOutcome::kNeedsWholeLayer) {
      if (!whole) whole = std::make_unique<State>(shared, whole_scope(job));
      return whole->paint(layer, cancel);
    }
    cut(part, cancel);
    choose_materials(layer, part, cancel);
    return part;
  }
};

std::shared_ptr<const PartPainter::Shared> PartPainter::share(const PlacedPart& part, const CancellationToken& cancel,
                                                              std::optional<bool> tiles_fit, const Shared* before) {
  const SliceJob& job = part.job;
  auto index = std::make_shared<const ContourIndex>(*part.solid, job.placement, Vec3::UnitZ(), cancel);
  std::shared_ptr<const HalftonePlan> halftone = before != nullptr ? before->halftone : nullptr;
  const VoxelPitch& pitch = job.grid.pitch;
  if (shows_materials(job) && !halftone) {
    halftone = std::make_shared<const HalftonePlan>(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm, cancel);
  }
  if (!tiles_fit && job.channel_tolerance != 0 && PartPlanes(job, part.solid->summary()).need_solid()) {
    tiles_fit = do_tiles_fit(part.solid, interpolation_spec_of(job, part.solid->summary().channels), cancel);
  }
  return std::make_shared<const Shared>(
      Shared{part.solid, job, std::move(index), std::move(halftone), make_cell_node_store(tiles_fit)});
}

PartPainter::PartPainter(std::shared_ptr<const Shared> shared)
    : state_([&] {
        const LayerScope scope = scope_of(shared->job);
        return std::make_unique<State>(std::move(shared), scope);
      }()) {}
PartPainter::~PartPainter() = default;
PartPainter::PartPainter(PartPainter&&) noexcept = default;
PartPainter& PartPainter::operator=(PartPainter&&) noexcept = default;

PaintedPart PartPainter::paint(std::uint32_t layer, const CancellationToken& cancel) {
  return state_->paint(layer, cancel);
}

}  // namespace ccslice
