// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/slice_job.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/count_text.h"
#include "core/base/echo.h"
#include "core/base/engine_version.h"
#include "core/base/number_text.h"
#include "core/base/place_text.h"
#include "core/inversion/thin_features.h"
#include "core/limit/limit_evaluator.h"
#include "core/output/encodings.h"
#include "core/output/plane.h"
#include "core/prepare/deviation.h"
#include "core/printing/values_off_map.h"
#include "core/slicer/layer_slicer.h"
#include "core/volume/outside_share.h"
#include "core/volume/volume_source.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/deviation_warnings.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/rpc/convert/plan_warning.h"
#include "server/rpc/convert/printer.h"
#include "server/service/base/limits.h"

namespace ccslice::server {
namespace {

/// Fraction of the raw size that typical parts leave. Occupancy is mostly long runs; graded channels are smooth, half
/// of them outside.
double typical_compression(const PlaneSpec& plane) {
  const EncodingTraits& encoding = *find_encoding(plane.encoding);
  if (!encoding.compressed) return 1;
  if (plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask) {
    return 0.4;  // Half of a part's box is inside, where halftones are noise.
  }
  if (plane.content == PlaneContent::kCellRegions) return 0.05;
  switch (plane.sample_type) {
    case SampleType::kBit: return encoding.widens_bits ? 0.2 : 0.05;
    case SampleType::kUint8: return 0.1;
    case SampleType::kUint16: return 0.4;
    case SampleType::kFloat32: return 0.5;
    case SampleType::kUint2:
    case SampleType::kUint4: return 1;
  }
  return 1;
}

Box3 box_of(const VoxelBox& region, const Grid& grid) {
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  const Vec3 first(region.first_column, region.first_row, region.first_layer);
  const Vec3 size(region.extent.columns, region.extent.rows, region.extent.layers);
  const Vec3 low = grid.origin_mm + first.cwiseProduct(pitch);
  return Box3(low, low + size.cwiseProduct(pitch));
}

Box3 grid_box(const Grid& grid) { return box_of(whole_region(grid), grid); }

/// The listed cells, and the middle of the limit of each, where it is found at once.
void warn_of_inverted_cells(const SliceJob& job, const LimitSolid& solid, v1::PlanSlicesResponse& plan) {
  constexpr int kDigits = 4;
  const std::vector<std::uint32_t>& inverted = solid.summary().inverted_control_cells;
  if (inverted.empty()) return;
  v1::PlanWarning& warning = add_warning(plan, v1::PLAN_WARNING_KIND_INVERTED_CELLS, "");
  const auto listed = std::span(inverted).first(std::min(inverted.size(), kMaxListedItems));
  LimitEvaluator evaluator(solid);
  std::string where;
  std::size_t next = 0;  // Limit cells are in the order of their control cells, as the listed ones are.
  for (const LimitCellId cell : solid.cells()) {
    while (next < listed.size() && listed[next] < solid.control_cell(cell)) ++next;
    if (next == listed.size()) break;
    if (listed[next] != solid.control_cell(cell)) continue;
    const Vec3 place = job.placement * evaluator.geo({cell, Vec3::Constant(0.5)});
    if (where.empty()) where = ", the first near " + place_text(place, kDigits);
    *warning.add_places_mm() = to_message(place);
    ++next;
  }
  for (const std::uint32_t cell : listed) warning.add_control_cells(cell);
  warning.set_message(count_text(inverted.size(), "control cell") + (inverted.size() == 1 ? " is" : " are") +
                      " inverted" + where + "; repair the mesh if that isn't meant");
}

/// Depths are those of the placed part where the placement keeps angles.
void warn_of_overlaps(const SliceJob& job, const Overlaps& overlaps, v1::PlanSlicesResponse& plan) {
  if (overlaps.cells == 0) {
    if (overlaps.at_least) {
      add_warning(
          plan, v1::PLAN_WARNING_KIND_OVERLAP,
          "cells may overlap: none were found that do, but so many faces of the boundary are close to others that "
          "not all were looked at");
    }
    return;
  }
  constexpr int kDigits = 4, kSizeDigits = 3;
  const double scale = std::abs(job.placement.linear().determinant());
  const OverlapPlace& first = overlaps.places.front();
  v1::PlanWarning& warning = add_warning(
      plan, v1::PLAN_WARNING_KIND_OVERLAP,
      (overlaps.at_least ? "at least " : "") + std::to_string(overlaps.cells) +
          " limit cells overlap others that they don't touch, by up to " +
          number_text(std::cbrt(scale) * overlaps.depth_mm, kSizeDigits) + " mm and about " +
          number_text(scale * overlaps.volume_mm3, kSizeDigits) + " mm^3 in all, control cells " +
          std::to_string(first.cell) + " and " + std::to_string(first.other) + " near " +
          place_text(job.placement * first.position, kDigits) +
          "; there the lowest cell of a part gives the material, and of several parts the first one. Move them apart, "
          "or join them by common vertices");
  constexpr std::size_t kMostPairs = kMaxListedItems / 2;
  for (const OverlapPlace& place : std::span(overlaps.places).first(std::min(overlaps.places.size(), kMostPairs))) {
    *warning.add_places_mm() = to_message(Vec3(job.placement * place.position));
    warning.add_control_cells(place.cell);
    warning.add_control_cells(place.other);
  }
}

void warn_of_solid(const SliceJob& job, const SolidSummary& solid, v1::PlanSlicesResponse& plan) {
  if (solid.folding_cells > 0) {
    constexpr int kDigits = 4;
    std::string where;
    if (!solid.folds.empty()) {
      const FoldPlace& fold = solid.folds.front();
      where = ", one of them in control cell " + std::to_string(fold.control_cell) + " near " +
              place_text(job.placement * fold.position, kDigits);
    }
    v1::PlanWarning& warning =
        add_warning(plan, v1::PLAN_WARNING_KIND_FOLDS,
                    "the limit volume folds over itself in " + count_text(solid.folding_cells, "limit cell") + where +
                        "; there the lowest cell gives the material. Untwist the mesh there");
    for (const FoldPlace& fold : solid.folds) {
      *warning.add_places_mm() = to_message(Vec3(job.placement * fold.position));
      warning.add_control_cells(fold.control_cell);
    }
  }
  warn_of_overlaps(job, solid.overlaps, plan);
  if (job.placement.linear().determinant() < 0) {
    add_warning(plan, v1::PLAN_WARNING_KIND_MIRRORED,
                "the placement mirrors the part; flip an axis back if that isn't meant");
  }
}

void warn_of_grid(const SliceJob& job, v1::PlanSlicesResponse& plan) {
  const Grid& grid = job.grid;
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  const Box3 box = grid_box(grid);
  if (!box.intersects(grid.part_box)) {
    add_warning(
        plan, v1::PLAN_WARNING_KIND_GRID_EMPTY,
        "the grid doesn't meet the part: all layers will be empty. Leave out grid.origin_mm and grid.extent, or move "
        "one to the other");
  } else if (!box_of(region_of(job), grid).intersects(grid.part_box)) {
    add_warning(plan, v1::PLAN_WARNING_KIND_GRID_EMPTY,
                "the region doesn't meet the part: all layers will be empty. Move the region");
  } else if (((box.min() - grid.part_box.min()).array() > pitch.array()).any() ||
             ((grid.part_box.max() - box.max()).array() > pitch.array()).any()) {
    add_warning(plan, v1::PLAN_WARNING_KIND_PART_CLIPPED,
                "the grid cuts off part of the solid; leave out grid.extent for a grid that holds it all");
  }
  if ((grid.part_box.sizes().array() < pitch.array()).any()) {
    add_warning(plan, v1::PLAN_WARNING_KIND_THINNER_THAN_VOXEL,
                "the part is smaller than a voxel in some direction; use a smaller pitch");
  }
  if (job.contour_tolerance_mm > 0.5 * std::min(grid.pitch.x_mm, grid.pitch.y_mm)) {
    add_warning(
        plan, v1::PLAN_WARNING_KIND_COARSE_TOLERANCE,
        "tolerances.contour_mm is larger than half a voxel: voxels at the boundary may be wrong; use a smaller one");
  }
}

constexpr double kLeastShare = 0.01;  // Of a map's volume, for a warning.

/// Whose map it is, for messages.
std::string owner_of(const MaterialMap* map, const Printing& printing, const LimitSolid& solid) {
  for (const CellRegionMap& own : printing.cell_region_maps) {
    if (&own.map != map) continue;
    return "the map of cell region '" + echoed(solid.summary().cell_regions[own.cell_region].name) + "'";
  }
  return "the material map";
}

void warn_of_fractions_below_one(const Printing& printing, const LimitSolid& solid, v1::PlanSlicesResponse& plan) {
  constexpr int kDigits = 3;
  for (const FractionsBelowOne& below : find_fractions_below_one(printing, solid)) {
    if (below.share < kLeastShare) continue;
    add_warning(plan, v1::PLAN_WARNING_KIND_FRACTIONS_BELOW_ONE,
                "the fractions of " + owner_of(below.map, printing, solid) + " add up to less than 1, down to " +
                    number_text(below.least_sum, kDigits) + ", in about " +
                    std::to_string(std::lround(100 * below.share)) +
                    " % of the volume: there they are scaled up to make 1. Let a material take the rest "
                    "(rest_material; rest=NAME in --map of ccslice)");
  }
}

void warn_of_values_off_maps(const SliceJob& job, const LimitSolid& solid, v1::PlanSlicesResponse& plan) {
  const Printing& printing = *job.printing;
  constexpr int kDigits = 4;
  const auto range_text = [](double low, double high) {
    return number_text(low, kDigits) + " to " + number_text(high, kDigits);
  };
  for (const ValuesOffMap& off : find_values_off_maps(printing, solid, job.sources, job.placement)) {
    if (off.share < kLeastShare) continue;
    const ChannelRange& channel = off.channel;
    add_warning(plan, v1::PLAN_WARNING_KIND_VALUES_OFF_MAP,
                "channel '" + echoed(channel.name) + "' runs from " + range_text(channel.min, channel.max) + ", and " +
                    owner_of(off.map, printing, solid) + " covers " + range_text(off.covered[0], off.covered[1]) +
                    ": about " + std::to_string(std::lround(100 * off.share)) +
                    " % of the volume takes what the nearer end gives. If that isn't meant, let the map cover the "
                    "channel");
  }
}

/// A field counts even if nothing reads it.
void warn_outside_volumes(const SliceJob& job, const LimitSolid& solid, const CancellationToken& cancel,
                          v1::PlanSlicesResponse& plan) {
  constexpr int kDigits = 4;
  const auto text_of = [](const Box3& box) {
    return place_text(box.min(), kDigits) + " to " + place_text(box.max(), kDigits);
  };
  std::vector<const VolumeSource*> volumes;
  for (const auto& source : job.sources) {
    if (const auto* of_volume = dynamic_cast<const VolumeSource*>(source.get())) volumes.push_back(of_volume);
  }
  const std::vector<double> shares = shares_outside(volumes, solid, job.placement, cancel);
  const Box3& own = solid.summary().bounding_box;
  for (std::size_t v = 0; v < volumes.size(); ++v) {
    if (shares[v] < kLeastShare) continue;
    const Box3 part = volumes[v]->follows_part() ? own : own.transformed(Placement(job.placement));
    add_warning(plan, v1::PLAN_WARNING_KIND_OUTSIDE_VOLUME,
                "field '" + echoed(volumes[v]->range().name) + "' has no samples in about " +
                    std::to_string(std::lround(100 * shares[v])) + " % of the part, which takes the value outside: " +
                    "its samples are at " + text_of(volumes[v]->box()) + ", the part is at " + text_of(part) +
                    ". If that isn't meant, correct where the volume lies");
  }
}

/// What is printed right of any feature, by what is asked for, the printer, or the pitch.
SmallestFeature smallest_feature(const v1::PlanSlicesRequest& request, const VoxelPitch& pitch) {
  constexpr double kVoxels = 2;
  const double mm = request.smallest_feature_mm();
  if (!(mm >= 0) || !std::isfinite(mm)) {
    throw Error(ErrorCode::kToleranceInvalid,
                "smallest_feature_mm: " + number_text(mm) +
                    " is negative or not finite; give a length, 0 for no warning, or leave it out for two voxels",
                "smallest_feature_mm");
  }
  if (request.has_smallest_feature_mm()) return {.mm = mm, .voxels_mm = Vec3::Zero()};
  const v1::SliceJob& job = request.job();
  const double printers = job.has_printer() ? to_printer(job.printer()).smallest_feature_mm : 0;
  if (printers > 0) return {.mm = printers, .voxels_mm = Vec3::Zero()};
  return {.mm = 0, .voxels_mm = kVoxels * Vec3(pitch.x_mm, pitch.y_mm, pitch.z_mm)};
}

void warn_of_thin_features(const SliceJob& job, const LimitSolid& solid, const SmallestFeature& smallest,
                           const CancellationToken& cancel, v1::PlanSlicesResponse& plan) {
  constexpr int kDigits = 3;
  const VoxelPitch& pitch = job.grid.pitch;
  // All of a part that is smaller than a voxel is thin, and says so already.
  if ((job.grid.part_box.sizes().array() < Vec3(pitch.x_mm, pitch.y_mm, pitch.z_mm).array()).any()) return;
  const ThinFeatures found = find_thin_features(solid, job.placement, smallest, cancel);
  if (found.places.empty()) return;
  const ThinPlace& thinnest = found.places.front();
  v1::PlanWarning& warning = add_warning(
      plan, v1::PLAN_WARNING_KIND_THIN_FEATURE,
      "the part is only " + number_text(thinnest.thickness_mm, kDigits) + " mm thick at " +
          place_text(thinnest.position, kDigits + 1) + ", less than the smallest feature of " +
          number_text(thinnest.least_mm, kDigits) + " mm" + (smallest.mm > 0 ? "" : " there, two voxels") + ", as at " +
          std::to_string(found.places.size()) + " of " + std::to_string(found.samples) +
          " places of the surface that were looked at. It may come out broken or not at all: thicken it, scale the "
          "part, or use a finer pitch; smallest_feature_mm (--smallest-feature of ccslice) says what is too thin");
  for (std::size_t i = 0; i < found.places.size() && i < kMaxListedItems; ++i) {
    *warning.add_places_mm() = to_message(found.places[i].position);
    const auto& listed = warning.control_cells();
    const std::uint32_t cell = found.places[i].control_cell;
    if (std::find(listed.begin(), listed.end(), cell) == listed.end()) warning.add_control_cells(cell);
  }
}

/// Of one part in one place, apart from its grid.
void warn_of_part(const PlacedPart& part, const Deviation& deviation, const SmallestFeature& smallest,
                  const CancellationToken& cancel, v1::PlanSlicesResponse& plan) {
  const LimitSolid& solid = *part.solid;
  const SliceJob& job = part.job;
  warn_of_solid(job, solid.summary(), plan);
  warn_of_inverted_cells(job, solid, plan);
  warn_of_deviation(job, solid, deviation, plan);
  warn_of_thin_features(job, solid, smallest, cancel, plan);
  warn_outside_volumes(job, solid, cancel, plan);
  if (!job.printing) return;
  warn_of_values_off_maps(job, solid, plan);
  warn_of_fractions_below_one(*job.printing, solid, plan);
}

/// The voxels of one layer of a region, in the middle of a box.
std::optional<VoxelBox> layer_within(const Box3& box_mm, const Grid& grid, const VoxelBox& region) {
  const Vec3 pitch(grid.pitch.x_mm, grid.pitch.y_mm, grid.pitch.z_mm);
  const Vec3 low = (box_mm.min() - grid.origin_mm).cwiseQuotient(pitch).array().floor();
  const Vec3 high = (box_mm.max() - grid.origin_mm).cwiseQuotient(pitch).array().ceil();
  const auto within = [](double at, std::uint32_t first, std::uint32_t count) {
    return static_cast<std::uint32_t>(std::clamp<double>(at, first, static_cast<double>(first) + count));
  };
  const GridExtent& extent = region.extent;
  const std::uint32_t column = within(low.x(), region.first_column, extent.columns);
  const std::uint32_t row = within(low.y(), region.first_row, extent.rows);
  const double middle = std::floor(0.5 * (low.z() + high.z()));
  if (middle < region.first_layer || middle >= region.end_layer()) return std::nullopt;
  const std::uint32_t columns = within(high.x(), region.first_column, extent.columns) - column;
  const std::uint32_t rows = within(high.y(), region.first_row, extent.rows) - row;
  if (columns == 0 || rows == 0) return std::nullopt;
  return VoxelBox{column, row, static_cast<std::uint32_t>(middle), {columns, rows, 1}};
}

/// Looks at pairs of parts whose boxes meet, at a few of them and in one layer: voxels in both are warned of, or
/// refused.
void look_for_overlaps(const PlacedParts& parts, const CancellationToken& cancel, v1::PlanSlicesResponse& plan) {
  constexpr std::size_t kMostPairs = 8, kMostFaces = 1 << 18;
  const SliceJob& job = parts.front().job;
  const Vec3 pitch(job.grid.pitch.x_mm, job.grid.pitch.y_mm, job.grid.pitch.z_mm);
  std::vector<Box3> boxes;
  for (const PlacedPart& part : parts) {
    boxes.push_back(part.solid->summary().bounding_box.transformed(part.job.placement));
  }
  std::size_t pairs = 0, faces = 0;
  for (std::size_t a = 0; a < parts.size(); ++a) {
    cancel.throw_if_cancelled();
    for (std::size_t b = 0; b < a && pairs < kMostPairs; ++b) {
      const Box3 common = boxes[a].intersection(boxes[b]);
      if (common.isEmpty() || (common.sizes().array() < pitch.array()).any()) continue;
      const std::size_t of_pair = parts[a].solid->summary().boundary_faces + parts[b].solid->summary().boundary_faces;
      const std::optional<VoxelBox> look = layer_within(common, job.grid, region_of(job));
      if (!look || faces + of_pair > kMostFaces) continue;
      faces += of_pair;
      ++pairs;
      PlacedParts two = {parts[b], parts[a]};
      for (PlacedPart& part : two) {
        part.is_copy = false;
        part.job.planes.clear();
        part.job.printing.reset();
        part.job.region = look;
        part.job.contours = part.job.contours_by_cell_region = false;
        part.job.refuses_overlaps = true;
      }
      try {
        (void)LayerSlicer(std::move(two), cancel).slice(look->first_layer, cancel);
      } catch (const Error& error) {
        if (error.code() != ErrorCode::kPartsOverlap || job.refuses_overlaps) throw;
        const std::string_view what = error.what();
        const std::size_t begin = what.find(' ') + 1;
        add_warning(plan, v1::PLAN_WARNING_KIND_PARTS_OVERLAP,
                    std::string(what.substr(begin, what.rfind(';') - begin)) +
                        ": they are of the part with the higher priority, or else of the first one. Move the parts "
                        "apart, or say by priorities which one is to have them");
        return;
      }
    }
  }
}

/// Adds the warnings of a part in one place that weren't said of it before. `name`: of the part, or of its copy; empty
/// if there is no other.
void add_warnings_of_part(const v1::PlanSlicesResponse& of_part, const std::string& name,
                          std::optional<std::uint32_t> part, std::set<std::string>& told,
                          v1::PlanSlicesResponse& plan) {
  for (const v1::PlanWarning& warning : of_part.warnings()) {
    if (!told.insert(warning.message()).second) continue;
    v1::PlanWarning& added = *plan.add_warnings() = warning;
    if (!name.empty()) added.set_message("part '" + echoed(name) + "': " + warning.message());
    if (part) added.set_part(*part);
  }
}

/// What the plan says of the parts. Copies that differ by where they lie alone have the same warnings, and the first
/// one stands for them. So many copies that lie otherwise are looked at of each part: that takes time.
void describe_parts(const v1::SliceJob& message, const PlacedParts& parts, const SmallestFeature& smallest,
                    const CancellationToken& cancel, v1::PlanSlicesResponse& plan) {
  constexpr std::size_t kMostWaysToLie = 8;
  const std::vector<PartPlace> places = part_places(message);
  const bool is_one_part = message.parts_size() == 1;
  std::vector<std::size_t> looked_at;  // Of the part at hand.
  std::set<std::string> told;          // Of it.
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const bool is_copy = places[i].placement > 0;
    if (!is_copy) {
      looked_at.clear();
      told.clear();
    }
    const bool is_like_another = std::ranges::any_of(
        looked_at, [&](std::size_t other) { return lie_alike(parts[other].job.placement, parts[i].job.placement); });
    if (is_like_another || looked_at.size() == kMostWaysToLie) continue;
    looked_at.push_back(i);
    v1::PlanSlicesResponse of_part;
    const Deviation deviation = placed_deviation(*parts[i].solid, parts[i].job.placement);
    if (parts.size() == 1) *plan.mutable_deviation() = to_message(deviation);
    warn_of_part(parts[i], deviation, smallest, cancel, of_part);
    const auto part = static_cast<std::uint32_t>(places[i].part);
    const std::string name = is_copy ? parts[i].name : message.parts(places[i].part).name();
    add_warnings_of_part(of_part, is_one_part && !is_copy ? "" : name, is_one_part ? std::nullopt : std::optional(part),
                         told, plan);
  }
  if (parts.size() > 1) at_job(kJobPath, [&] { look_for_overlaps(parts, cancel, plan); });
}

}  // namespace

v1::PlanSlicesResponse plan_slices(const v1::PlanSlicesRequest& request,
                                   std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                                   const CancellationToken& cancel, const Volumes& volumes) {
  v1::SliceJob message = request.job();
  if (message.planes().empty()) message.mutable_contours();  // A job of nothing would be refused; a plan of it is fine.
  SnappedCopies snapped;
  const PlacedParts parts = to_placed_parts(message, kJobPath, solids, limits, cancel, &snapped, volumes);
  const SliceJob& job = parts.front().job;

  v1::PlanSlicesResponse plan;
  if (message.snap()) {
    plan.mutable_snapped()->set_copies(static_cast<std::uint32_t>(snapped.copies));
    *plan.mutable_snapped()->mutable_most_mm() = to_message(snapped.most_mm);
    plan.mutable_snapped()->set_computed(static_cast<std::uint32_t>(copy_groups(parts).size()));
  }
  *plan.mutable_grid() = to_message(job.grid);
  *plan.mutable_size_mm() = to_message(Vec3(grid_box(job.grid).sizes()));
  const VoxelBox region = region_of(job);
  *plan.mutable_region() = to_message(region);
  *plan.mutable_layout() = with_defaults(message.layout());
  plan.set_layer_count(region.extent.layers);
  plan.set_raw_bytes_per_layer(layer_bytes(job));
  plan.set_raw_bytes(layer_bytes(job) * region.extent.layers);
  double estimate = 0;
  for (const PlaneSpec& plane : job.planes) {
    estimate += typical_compression(plane) * static_cast<double>(sample_bytes(plane, region.window()));
  }
  plan.set_estimated_bytes(static_cast<std::uint64_t>(std::llround(estimate * region.extent.layers)));
  describe_parts(message, parts, smallest_feature(request, job.grid.pitch), cancel, plan);
  warn_of_grid(job, plan);
  if ((job.cut || leaves_voxels_empty(job)) && request.job().has_contours()) {
    add_warning(
        plan, v1::PLAN_WARNING_KIND_CONTOURS_UNCUT,
        "contours are those of the whole part, also where voxels of it are cut out or left empty; take pictures "
        "instead");
  }
  if (message.has_printer()) warn_of_printer(job, to_printer(message.printer()), plan);
  plan.set_engine_version(std::string(kEngineVersion));
  return plan;
}

std::uint64_t layer_bytes(const SliceJob& job) {
  std::uint64_t bytes = 0;
  for (const PlaneSpec& plane : job.planes) bytes += sample_bytes(plane, region_of(job).window());
  return bytes;
}

}  // namespace ccslice::server
