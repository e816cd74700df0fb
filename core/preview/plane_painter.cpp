// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/plane_painter.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/error.h"
#include "core/contour/contour_index.h"
#include "core/contour/contour_tracer.h"
#include "core/field/material_field.h"
#include "core/field/source_pass.h"
#include "core/preview/outline_lines.h"
#include "core/preview/pixel_colours.h"
#include "core/preview/plane_sampler.h"
#include "core/raster/occupancy.h"
#include "core/raster/region_runs.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/cut.h"
#include "core/slicer/part_planes.h"

namespace ccslice {
namespace {

constexpr double kCoarseTolerance = 1.0 / 32, kFullTolerance = 1.0 / 256;
constexpr double kCoarseContour = 0.5, kFullContour = 0.1;  // Pixels.

/// The picture as a layer of a job under the plane.
SliceJob layer_job(const PreviewJob& job, const PreviewPlane& plane, PreviewStage stage) {
  const bool full = stage == PreviewStage::kFull;
  const SliceLimits limits;
  SliceJob layer;
  layer.placement = under_plane(plane, job.placement);
  layer.grid = grid_of(plane);
  layer.sources = job.sources;
  layer.cut = job.cut;
  layer.contour_tolerance_mm =
      std::clamp((full ? kFullContour : kCoarseContour) * std::min(plane.across_mm, plane.up_mm),
                 limits.min_contour_tolerance_mm, limits.max_contour_tolerance_mm);
  layer.channel_tolerance = full ? kFullTolerance : kCoarseTolerance;
  if (job.show.content == PreviewContent::kOccupancy) return layer;
  PlaneSpec& shown = layer.planes.emplace_back();
  if (job.show.content == PreviewContent::kChannel) {
    shown.content = PlaneContent::kChannel;
    shown.channel = job.show.channel;
    shown.sample_type = SampleType::kFloat32;
    shown.range = job.show.range;
  } else {
    shown.content = PlaneContent::kMaterials;
    layer.printing = *job.show.printing;
  }
  return layer;
}

}  // namespace

std::vector<std::vector<Vec2>> outlines_of(std::span<const ContourLoop> loops, const Vec2& corner) {
  std::vector<std::vector<Vec2>> outlines;
  for (const ContourLoop& loop : loops) {
    std::vector<Vec2>& outline = outlines.emplace_back();
    for (const ContourPoint& point : loop.points) outline.push_back(point.xy - corner);
  }
  return outlines;
}

class PlanePainter::State {
 public:
  explicit State(std::shared_ptr<const LimitSolid> solid) : solid_(std::move(solid)), sampler_(solid_) {}

  PreviewPicture paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel);

 private:
  struct Field {
    double outside_mm = 0;
    std::unique_ptr<MaterialField> field;
  };

  void lay_under(const Placement& placement, const SliceJob& layer, const CancellationToken& cancel);
  Contours trace(const SliceJob& layer, const CancellationToken& cancel);
  MaterialField& field_of(const SliceJob& layer, PreviewStage stage);
  std::vector<RegionRun> regions_of(const SliceJob& layer, const Contours& contours, std::span<const VoxelRun> spans,
                                    const CancellationToken& cancel) const;
  void evaluate(const SliceJob& layer, const Mat3& frame, std::span<const VoxelRun> spans,
                std::span<const RegionRun> regions, PreviewStage stage, PartPlanes& planes,
                const CancellationToken& cancel);

  const HalftonePlan* plan_of(const PreviewJob& job, const CancellationToken& cancel);

  std::shared_ptr<const LimitSolid> solid_;
  PlaneSampler sampler_;
  // These follow from the part's placement:
  std::optional<Placement> placement_;
  double scale_mm_ = 0;
  // These follow from the plane's orientation, too:
  std::optional<Placement> under_plane_;
  std::shared_ptr<const ContourIndex> index_;
  std::optional<ContourTracer> tracer_;
  std::array<Field, 2> fields_;  // By stage.
  // What printed contents are made by:
  struct Plan {
    std::shared_ptr<const Printing> printing;
    PreviewContent content = PreviewContent::kMix;
    VoxelPitch pitch;
    std::optional<HalftonePlan> plan;
  } plan_;
};

PlanePainter::PlanePainter(std::shared_ptr<const LimitSolid> solid)
    : state_(std::make_unique<State>(std::move(solid))) {}
PlanePainter::~PlanePainter() = default;
PlanePainter::PlanePainter(PlanePainter&&) noexcept = default;
PlanePainter& PlanePainter::operator=(PlanePainter&&) noexcept = default;

PreviewPicture PlanePainter::paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel) {
  return state_->paint(job, stage, cancel);
}

/// `placement`: the part's; the layer's is that under the plane.
void PlanePainter::State::lay_under(const Placement& placement, const SliceJob& layer,
                                    const CancellationToken& cancel) {
  if (!placement_ || placement_->matrix() != placement.matrix()) {
    placement_.reset();
    under_plane_.reset();
    scale_mm_ = rounding_scale_mm(*solid_, placement, cancel);
    placement_ = placement;
  }
  if (under_plane_ && under_plane_->matrix() == layer.placement.matrix()) return;
  under_plane_.reset();
  index_ = std::make_shared<const ContourIndex>(*solid_, layer.placement, Vec3::UnitZ(), scale_mm_, cancel);
  if (tracer_) {
    tracer_->follow(index_);
  } else {
    tracer_.emplace(*solid_, index_);
  }
  for (Field& field : fields_) field.field.reset();
  under_plane_ = layer.placement;
}

Contours PlanePainter::State::trace(const SliceJob& layer, const CancellationToken& cancel) {
  SlicePlane plane;
  plane.origin = Vec3(0, 0, layer.grid.layer_z_mm(0));
  ContourOptions options;
  options.tolerance_mm = layer.contour_tolerance_mm;
  options.smallest_feature_mm = std::min(layer.grid.pitch.x_mm, layer.grid.pitch.y_mm);
  options.cancel = cancel;
  return tracer_->trace(plane, options);
}

MaterialField& PlanePainter::State::field_of(const SliceJob& layer, PreviewStage stage) {
  Field& known = fields_[stage == PreviewStage::kFull ? 1 : 0];
  const double outside_mm = outside_mm_of(layer);
  if (!known.field || known.outside_mm != outside_mm) {
    known = {outside_mm, make_material_field(solid_, layer.placement, outside_mm)};
  }
  return *known.field;
}

const HalftonePlan* PlanePainter::State::plan_of(const PreviewJob& job, const CancellationToken& cancel) {
  if (job.show.content != PreviewContent::kMix && job.show.content != PreviewContent::kHalftone) return nullptr;
  const VoxelPitch pitch = job.voxels ? job.voxels->pitch : VoxelPitch{1, 1, 1};
  const bool same_pitch =
      pitch.x_mm == plan_.pitch.x_mm && pitch.y_mm == plan_.pitch.y_mm && pitch.z_mm == plan_.pitch.z_mm;
  if (plan_.plan && plan_.printing == job.show.printing && plan_.content == job.show.content && same_pitch)
    return &*plan_.plan;
  plan_ = {};
  if (job.show.content == PreviewContent::kMix) {
    plan_.plan.emplace(mixed_only(*job.show.printing), 1, 1, 1, cancel);
  } else {
    plan_.plan.emplace(*job.show.printing, pitch.x_mm, pitch.y_mm, pitch.z_mm, cancel);
  }
  plan_.printing = job.show.printing;
  plan_.content = job.show.content;
  plan_.pitch = pitch;
  return &*plan_.plan;
}

std::vector<RegionRun> PlanePainter::State::regions_of(const SliceJob& layer, const Contours& contours,
                                                       std::span<const VoxelRun> spans,
                                                       const CancellationToken& cancel) const {
  if (solid_->has_several_regions()) {
    return find_regions(contours.region_edges, spans, layer.grid.lattice(), {}, cancel);
  }
  std::vector<RegionRun> runs;
  for (const VoxelRun& span : spans) runs.push_back({span, solid_->region_of(ControlCellId{0})});
  return runs;
}

void PlanePainter::State::evaluate(const SliceJob& layer, const Mat3& frame, std::span<const VoxelRun> spans,
                                   std::span<const RegionRun> regions, PreviewStage stage, PartPlanes& planes,
                                   const CancellationToken& cancel) {
  const LayerLattice lattice = layer.grid.lattice();
  planes.clear(window_of(lattice), cancel);
  if (planes.channels().empty()) return;
  if (!solid_->has_several_regions()) regions = {};  // No channel jumps.
  LayerStats stats;
  const bool has_own_range =
      !layer.planes.empty() && layer.planes.front().content == PlaneContent::kChannel && !layer.planes.front().range;
  const LayerTarget target{lattice, layer.grid.layer_z_mm(0), planes.channels(), stats,
                           cancel,  window_of(lattice),       window_of(lattice)};
  if (planes.need_solid()) {
    sampler_.paint(target, interpolation_spec_of(layer, solid_->summary().channels), field_of(layer, stage), spans,
                   regions, {.rough = stage == PreviewStage::kCoarse, .own_range = has_own_range});
  }
  SourcePass(used_sources(layer), planes.specs(), layer.placement, frame).run(target, spans);
}

PreviewPicture PlanePainter::State::paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel) {
  const PreviewPlane plane = stage == PreviewStage::kFull ? job.plane : coarser(job.plane, kCoarseTimes);
  const SliceJob layer = layer_job(job, plane, stage);
  lay_under(job.placement, layer, cancel);
  const Contours contours = trace(layer, cancel);
  std::vector<VoxelRun> spans = rasterize(contours, layer.grid.lattice(), {}, cancel);
  std::vector<RegionRun> regions;
  if (job.show.content != PreviewContent::kOccupancy || job.cut) regions = regions_of(layer, contours, spans, cancel);
  PartPlanes planes(layer, solid_->summary());
  evaluate(layer, frame_of(plane), spans, regions, stage, planes, cancel);
  if (layer.cut) {
    cut_part(planes, window_of(layer.grid.lattice()), spans, regions, cancel);
  }
  std::vector<SampleImage> values;
  const bool shows_channel = job.show.content == PreviewContent::kChannel;
  for (const ContonePlane& channel : shows_channel ? planes.shown() : planes.mixed()) values.push_back(channel.image());

  PreviewPicture picture;
  picture.columns = plane.columns;
  picture.rows = plane.rows;
  picture.across_mm = plane.across_mm;
  picture.up_mm = plane.up_mm;
  const HalftonePlan* plan = plan_of(job, cancel);
  if (job.show.content == PreviewContent::kHalftone) {
    halftone_pixels(plane, *job.voxels, *plan, values, mixed_runs(*plan, regions), picture, cancel);
  } else if (job.show.content == PreviewContent::kMix) {
    const MixedPixels mixed{plan, values, mixed_runs(*plan, regions)};
    mix_pixels(std::span(&mixed, 1), picture, cancel);
  } else {
    colour_pixels(job.show, values, spans, picture);
  }
  if (job.contours || job.show.lines) picture.outlines = outlines_of(contours.loops, layer.grid.origin_mm.head<2>());
  if (job.show.lines) draw_lines(job.show, stage == PreviewStage::kFull ? 1 : kCoarseTimes, picture, cancel);
  return picture;
}

}  // namespace ccslice
