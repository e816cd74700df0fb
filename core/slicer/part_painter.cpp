// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/part_painter.h"

#include <algorithm>
#include <concepts>
#include <deque>
#include <utility>

#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/field/material_field.h"
#include "core/field/material_pass.h"
#include "core/field/source_pass.h"
#include "core/interpolation/pieces/cell_node_store.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/interpolation/slab_materials.h"
#include "core/interpolation/tiles/tile_trials.h"
#include "core/raster/occupancy.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/cut.h"
#include "core/slicer/halftone_pass.h"
#include "core/slicer/layer_scope.h"
#include "core/slicer/part_planes.h"

namespace ccslice {

namespace {

/// Leaves of each run what the window holds.
template <typename Run>
void clip(const LayerWindow& window, std::vector<Run>& runs) {
  for (Run& run : runs) {
    const VoxelRun kept = window.clipped(run);
    run.begin = kept.begin;
    run.end = kept.end;
  }
  std::erase_if(runs, [](const Run& run) { return run.begin == run.end; });
}

// Unsigned numbers wrap, so adding a negative number subtracts.
LayerWindow moved(LayerWindow window, const VoxelShift& shift) {
  window.first_column += static_cast<std::uint32_t>(shift.columns);
  window.first_row += static_cast<std::uint32_t>(shift.rows);
  return window;
}

template <std::derived_from<VoxelRun> Run>
Run moved(Run run, const VoxelShift& shift) {
  run.row += static_cast<std::uint32_t>(shift.rows);
  run.begin += static_cast<std::uint32_t>(shift.columns);
  run.end += static_cast<std::uint32_t>(shift.columns);
  return run;
}

template <typename Run>
std::vector<Run> moved(std::vector<Run> runs, const VoxelShift& shift) {
  for (Run& run : runs) run = moved(run, shift);
  return runs;
}

PartShape moved(const PartShape& shape, const VoxelShift& shift, const LayerLattice& lattice) {
  PartShape result{shape.contours, moved(shape.spans, shift), moved(shape.regions, shift), shape.region_loops,
                   shape.stats};
  const Vec2 by_mm(shift.columns * lattice.dx_mm, shift.rows * lattice.dy_mm);
  for (ContourLoop& loop : result.contours.loops) {
    for (ContourPoint& point : loop.points) point.xy += by_mm;
  }
  for (RegionLoop& loop : result.region_loops) {
    for (Vec2& point : loop.points) point += by_mm;
  }
  return result;
}

}  // namespace

struct PartPainter::Shared {
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;                       // Of the whole grid, if several parts share it.
  std::optional<LayerWindow> within;  // CopyGroup::within, if so.
  LayerWindow region;                 // The columns and rows that are asked for.
  LayerWindow halftoned;              // Those that are halftoned for that.
  std::size_t groups;                 // Of the job.
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
  std::uint32_t layer = 0;                     // At hand,
  PaintedPart part;                            // and what is painted of it,
  const PartShape* uncut = nullptr;            // before the job cuts it,
  bool is_whole_needed = false;                // unless `whole` paints it.
  std::deque<PartShape> copies;                // Of its shape, as far as they were asked for.

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
    field =
        make_material_field(shared->solid, job.placement, outside_mm_of(job), VoxelBlocks::patch_bytes(shared->groups));
    if (job.channel_tolerance == 0) {
      materials.emplace(*field);
    } else {
      InterpolationSpec spec = interpolation_spec_of(job, shared->solid->summary().channels);
      spec.solids = shared->groups;
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
    if (shared->within) clip(*shared->within, result.spans);
    if (shows_cell_regions(job) || mixes_by_region()) result.regions = cell_regions(result, cancel);
    if (job.contours_by_cell_region) result.region_loops = region_loops(result.contours, cancel);
    result.contours.region_edges = {};
    if (!shared->within) limit_to_region(result);
    return result;
  }

  std::uint64_t voxels_in_region(std::span<const VoxelRun> spans, const VoxelShift& shift) const {
    std::uint64_t voxels = 0;
    for (const VoxelRun& span : spans) {
      const VoxelRun kept = shared->region.clipped(moved(span, shift));
      voxels += kept.end - kept.begin;
    }
    return voxels;
  }

  /// Leaves loops that meet the region, if the job delivers them, and counts.
  void limit_to_region(PartShape& shape) const {
    const LayerWindow& region = shared->region;
    if (region != window_of(lattice)) {
      drop_loops_outside(region, lattice, shape.contours.loops);
      drop_loops_outside(region, lattice, shape.region_loops);
    }
    shape.stats.contour_loops = shape.contours.loops.size();
    for (const ContourLoop& loop : shape.contours.loops) shape.stats.contour_points += loop.points.size();
    shape.stats.contour_leaves_unresolved = shape.contours.unresolved_leaves;
    if (!job.contours || job.contours_by_cell_region) shape.contours = {};
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

  WindowOutcome evaluate_channels(const CancellationToken& cancel) {
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
  void cut(const CancellationToken& cancel) {
    uncut = part.shape;
    if (!job.cut) return;
    remaining = *part.shape;
    cut_part(planes, part.window, remaining.spans, remaining.regions, cancel);
    part.shape = &remaining;
  }

  void choose_materials(PaintedPart& of, const CancellationToken& cancel) {
    if (!halftone) return;
    const HalftonePass::Place place{lattice, layer, job.grid.layer_z_mm(layer), of.window, shared->region};
    if (mixes_by_region()) {
      halftone->run(place, of.shape->regions, planes.mixed(), cancel);
    } else {
      halftone->run(place, of.shape->spans, planes.mixed(), cancel);
    }
    of.materials = halftone->image();
    of.halftone = shared->halftone.get();
    of.mixed = planes.mixed();
    of.stats.material_voxels = halftone->histogram();
    of.stats.voxels_off_map = halftone->misfits().off_map;
    of.stats.voxels_scaled_up = halftone->misfits().scaled_up;
    if (of.stats.voxels_scaled_up > 0) of.stats.least_fraction_sum = halftone->misfits().least_sum;
  }

  bool is_outside(const VoxelShift& shift) const {
    if (!shared->within || part.window.columns == 0) return false;
    LayerWindow near = shared->region;  // Contours may reach a voxel further than spans.
    near.columns += near.first_column > 0 ? 2 : 1;
    near.rows += near.first_row > 0 ? 2 : 1;
    near.first_column -= near.first_column > 0 ? 1 : 0;
    near.first_row -= near.first_row > 0 ? 1 : 0;
    const LayerWindow common = common_window(moved(part.window, shift), near);
    return common.columns == 0 || common.rows == 0;
  }

  void find(std::uint32_t the_layer, const CancellationToken& cancel) {
    cancel.throw_if_cancelled();
    layer = the_layer;
    is_whole_needed = false;
    part = {};
    if (slabs) {
      enter_slab(layer);
      part.shape = &shape_in_slab(layer, cancel);
    } else {
      own = shape(layer, cancel);
      part.shape = &own;
    }
    part.window = window_of(part.shape->spans);
    if (!shared->within) part.window = common_window(whole_bytes(part.window), scope.window);
    part.stats = part.shape->stats;
  }

  void paint(const CancellationToken& cancel) {
    part.planes = planes.shown();
    if (evaluate_channels(cancel) == WindowOutcome::kNeedsWholeLayer) {
      if (!whole) whole = std::make_unique<State>(shared, whole_scope(job));
      is_whole_needed = true;
      whole->find(layer, cancel);
      whole->paint(cancel);
      return;
    }
    cut(cancel);
    copies.clear();
  }

  PaintedPart copy(const VoxelShift& shift, const CancellationToken& cancel) {
    if (is_whole_needed) return whole->copy(shift, cancel);
    PaintedPart result = part;
    if (shared->within) {
      PartShape& shape = copies.emplace_back(moved(*part.shape, shift, lattice));
      clip(shared->halftoned, shape.spans);
      clip(shared->halftoned, shape.regions);
      limit_to_region(shape);
      result.shape = &shape;
      result.window = moved(part.window, shift);
      result.stats.contour_loops = shape.stats.contour_loops;
      result.stats.contour_points = shape.stats.contour_points;
      result.stats.contour_leaves_unresolved = shape.stats.contour_leaves_unresolved;
    }
    result.stats.voxels_inside = voxels_in_region(result.shape->spans, {});
    result.stats.voxels_cut = voxels_in_region(uncut->spans, shift) - result.stats.voxels_inside;
    choose_materials(result, cancel);
    return result;
  }
};

std::shared_ptr<const PartPainter::Shared> PartPainter::share(const PlacedParts& parts, const CopyGroup& group,
                                                              std::size_t groups, const CancellationToken& cancel,
                                                              std::optional<bool> tiles_fit, const Shared* before) {
  const PlacedPart& part = parts[group.copies.front().part];
  const SliceJob& job = part.job;
  auto index = std::make_shared<const ContourIndex>(*part.solid, job.placement, Vec3::UnitZ(), cancel);
  std::shared_ptr<const HalftonePlan> halftone = before != nullptr ? before->halftone : nullptr;
  const VoxelPitch& pitch = job.grid.pitch;
  if (chooses_materials(job) && !halftone) {
    halftone = std::make_shared<const HalftonePlan>(*job.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm, cancel);
  }
  if (!tiles_fit && job.channel_tolerance != 0 && PartPlanes(job, part.solid->summary()).need_solid()) {
    tiles_fit = do_tiles_fit(part.solid, interpolation_spec_of(job, part.solid->summary().channels), cancel);
  }
  Shared shared{part.solid,
                job,
                std::nullopt,
                region_of(job).window(),
                scope_of(job).window,
                groups,
                std::move(index),
                std::move(halftone),
                make_cell_node_store(tiles_fit, groups)};
  if (group.is_shared()) {
    shared.within = group.within;
    shared.job.region.reset();  // What one copy has outside of it another one may have within.
  }
  return std::make_shared<const Shared>(std::move(shared));
}

PartPainter::PartPainter(std::shared_ptr<const Shared> shared)
    : state_([&] {
        const LayerScope scope = scope_of(shared->job);
        return std::make_unique<State>(std::move(shared), scope);
      }()) {}
PartPainter::~PartPainter() = default;
PartPainter::PartPainter(PartPainter&&) noexcept = default;
PartPainter& PartPainter::operator=(PartPainter&&) noexcept = default;

void PartPainter::find(std::uint32_t layer, const CancellationToken& cancel) { state_->find(layer, cancel); }
LayerWindow PartPainter::window(const VoxelShift& shift) const { return moved(state_->part.window, shift); }
bool PartPainter::is_outside(const VoxelShift& shift) const { return state_->is_outside(shift); }
void PartPainter::paint(const CancellationToken& cancel) { state_->paint(cancel); }
PaintedPart PartPainter::copy(const VoxelShift& shift, const CancellationToken& cancel) {
  return state_->copy(shift, cancel);
}

}  // namespace ccslice
