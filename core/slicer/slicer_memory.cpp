// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slicer_memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/channel/channel_source.h"
#include "core/channel/channel_table.h"
#include "core/contour/contour.h"
#include "core/contour/surface_tree.h"
#include "core/interpolation/pieces/cell_node_store.h"
#include "core/interpolation/pieces/slab_pieces.h"
#include "core/interpolation/samples/small_cells.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/interpolation/tiles/tile_particles.h"
#include "core/interpolation/tiles/tile_trials.h"
#include "core/job/copies.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/cell_index.h"
#include "core/limit/limit_evaluator.h"
#include "core/output/encodings.h"
#include "core/output/plane.h"
#include "core/raster/region_runs.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/cut.h"
#include "core/slicer/cut_estimates.h"
#include "core/slicer/layer_scope.h"
#include "core/slicer/part_planes.h"

namespace ccslice {
namespace {

constexpr double kMiB = 1 << 20;

// Vectors that grow are half empty and, while they are moved, there twice.
constexpr double kGrowth = 2, kGrowthOfPieces = 1.5;

// What codecs, inverters and fitters keep at most, whatever the job.
constexpr double kCodecs = 4 * kMiB;
constexpr double kPartsOfInverter = 5 * kMiB;  // Where the solid folds, or parts of it overlap.
constexpr double kLinesOfCell = 5.4 * 1024;
constexpr double kStencilsOfCell = 10.8 * 1024;

// Of contours: points are there as crossings, between them, and in loops.
constexpr double kCopiesOfPoints = 3;
constexpr double kNodeBytes = sizeof(SurfaceNode) + sizeof(BezierNet) + 160;  // With vertices and marks.

// How finely cells are cut is found out for some of them: others may be cut more finely.
constexpr double kFiner = 1.25, kVoxelsOfTile = 128;
constexpr double kRunBytes = sizeof(ScannedRun) + sizeof(PieceRun);  // Scanned and painted.

/// What there is in a layer, or in a slab: the largest sum over intervals that overlap.
class IntervalSums {
 public:
  explicit IntervalSums(std::size_t places) : changes_(places + 1) {}

  /// `amount` at the places [low, high] that there are.
  void add(double low, double high, double amount) {
    const auto last = static_cast<double>(changes_.size() - 2);
    if (high < 0 || low > last) return;
    changes_[static_cast<std::size_t>(std::clamp(low, 0.0, last))] += amount;
    changes_[static_cast<std::size_t>(std::clamp(high, 0.0, last)) + 1] -= amount;
  }
  double most() const {
    double sum = 0, most = 0;
    for (const double change : changes_) most = std::max(most, sum += change);
    return most;
  }

 private:
  std::vector<double> changes_;
};

double voxels_of(const LayerWindow& window) { return static_cast<double>(window.columns) * window.rows; }

double plane_bytes(const PlaneSpec& plane, const LayerWindow& window) {
  return static_cast<double>(sample_bytes(plane, window));
}

/// Samples of channels and materials, of the window that a part is in.
double painted_bytes(const SliceJob& job, const LayerWindow& window) {
  double bytes = chooses_materials(job) ? voxels_of(window) : 0;
  for (const PlaneSpec& plane : all_channels(job)) bytes += plane_bytes(plane, window);
  return bytes;
}

/// What becomes of them on the way to bytes. `window`: what there are samples of.
double encoded_bytes(const SliceJob& job, const LayerWindow& window) {
  const LayerWindow region = region_of(job).window(), held = common_window(window, region);
  double bytes = 0, largest = 0;
  for (const PlaneSpec& plane : job.planes) {
    const LayerWindow& taken = find_encoding(plane.encoding)->takes_window ? held : region;
    if (plane.content == PlaneContent::kChannels) largest = std::max(largest, plane_bytes(plane, window));
    largest = std::max(largest, plane_bytes(plane, taken));
    bytes += plane_bytes(plane, taken);  // The layer's bytes: no more than raw, or little more.
    const bool is_of_numbers = plane.content == PlaneContent::kMaterials ||
                               plane.content == PlaneContent::kMaterialMask ||
                               plane.content == PlaneContent::kCellRegions;
    if (is_of_numbers || (plane.content == PlaneContent::kOccupancy && leaves_voxels_empty(job))) {
      bytes += voxels_of(taken);
    }
  }
  if (shows_cell_regions(job)) bytes += voxels_of(held);
  const double bits = voxels_of(region) / 8;
  return kCodecs + bytes + 3 * largest + bits;  // Side by side, in another order, and where a codec writes.
}

/// Rows of values that sources read and write.
double source_bytes(const SliceJob& job) {
  double most = 0;
  for (const UsedSource& use : used_sources(job)) {
    most = std::max(most, 1.0 + static_cast<double>(use.source->inputs().size()));
  }
  return kGrowth * most * job.grid.extent.columns * sizeof(float);
}

/// What planes and rows meet of the boundary.
struct Boundary {
  double faces = 0;      // In all.
  double nodes = 0;      // That its faces are halved into for all planes,
  double visited = 0;    // and those that one plane visits, at most.
  double points = 0;     // Of its contours.
  double rows = 0;       // Of all its faces that are cut, one after the other,
  double crossings = 0;  // and those of them that contours cross.
};

Boundary boundary_of(const LimitSolid& solid, const SliceJob& job, const LayerScope& scope,
                     const CancellationToken& cancel) {
  const BoundarySurface surface(solid);
  const Placement voxel_of = voxel_of_mesh(job.placement, job.grid);
  const VoxelBox region = region_of(job);
  struct CutFace {
    double low, high, rows;
  };
  std::array<std::vector<BoundaryFaceId>, 2> faces;  // Regular ones, others: that the region's layers may meet,
  std::array<std::vector<CutFace>, 2> cut_faces;     // and what is met of them.
  PeriodicPoll poll(cancel);
  for (const BoundaryFaceId face : IdRange<BoundaryFaceId>(surface.faces_and_interfaces().size())) {
    poll();
    const Box3 voxels = surface.hull_box(face).transformed(voxel_of);
    const double low = std::floor(voxels.min().z() - region.first_layer) - 1;
    const double high = std::ceil(voxels.max().z() - region.first_layer) + 1;
    if (high < 0 || low >= region.extent.layers) continue;
    const double first_row = std::max<double>(voxels.min().y(), scope.rows.begin);
    const double end_row = std::min<double>(voxels.max().y(), scope.rows.end);
    const std::size_t kind = surface.faces_and_interfaces()[face].regular ? 0 : 1;
    faces[kind].push_back(face);
    cut_faces[kind].push_back({low, high, std::max(0.0, end_row - first_row) + 1});
  }
  IntervalSums visited(region.extent.layers), points(region.extent.layers), rows(region.extent.layers),
      crossings(region.extent.layers);
  double nodes = 0;
  CutFaces cutter(solid, job);
  for (std::size_t kind = 0; kind < faces.size(); ++kind) {
    const CutFaces::Cut cut = cutter.cut(faces[kind], cancel);
    nodes += kFiner * cut.nodes * static_cast<double>(faces[kind].size());
    for (const CutFace& face : cut_faces[kind]) {
      visited.add(face.low, face.high, kFiner * cut.visited);
      points.add(face.low, face.high, kFiner * cut.points);
      rows.add(face.low, face.high, face.rows);
      crossings.add(face.low, face.high, std::min(1.0, kFiner * cut.rows) * face.rows);
    }
  }
  const double all = static_cast<double>(surface.faces_and_interfaces().size());
  return {all, nodes, visited.most(), points.most(), rows.most(), crossings.most()};
}

bool needs_regions(const SliceJob& job) {
  return shows_cell_regions(job) || (job.printing && !job.printing->cell_region_maps.empty());
}

/// Runs of a layer that is cut: what is left, while they are cut and after it, and what composing makes of that.
double cut_bytes(const SliceJob& job, const LayerWindow& window) {
  if (!job.cut) return 0;
  constexpr double kCopies = 4;
  const double voxels = static_cast<double>(window.columns) * window.rows;
  const double runs = std::min(voxels / 2 + window.rows, static_cast<double>(most_cut_runs(window)));
  return kGrowth * kCopies * runs * (sizeof(VoxelRun) + (needs_regions(job) ? sizeof(RegionRun) : 0));
}

/// Spans and contours of a layer.
double shape_bytes(const Boundary& boundary, const SliceJob& job, const LayerScope& scope) {
  const double rows = scope.rows.end - scope.rows.begin;
  const double spans =
      std::min(boundary.crossings / 2 + rows, rows * (job.grid.extent.columns / 2 + 1.0)) * sizeof(VoxelRun);
  return (needs_regions(job) ? 3 : 1) * spans + (job.contours ? boundary.points * sizeof(ContourPoint) : 0);
}

/// `kept_layers`: those whose spans and contours are kept.
double contour_bytes(const Boundary& boundary, const SliceJob& job, const LayerScope& scope, double kept_layers) {
  const double kept = std::max<double>(SurfaceTree::kKeptNodes, 8 * boundary.visited) + boundary.visited;
  const double nodes = std::min(kept, boundary.nodes);
  const double loops = boundary.points * sizeof(ContourPoint);
  const double crossings =
      std::min(boundary.crossings, std::max<double>(1 << 20, 4 * boundary.points)) * sizeof(std::uint64_t);
  const double row_begins = 8.0 * job.grid.extent.rows;
  return kGrowth * (nodes * kNodeBytes + kCopiesOfPoints * loops + kept_layers * shape_bytes(boundary, job, scope)) +
         crossings + row_begins;
}

/// What slabs meet of the cells.
struct Cells {
  double pieces = 0;       // In the fullest slab.
  double all_pieces = 0;   // Of all slabs.
  double runs = 0;         // Of pieces, in it.
  double tile_voxels = 0;  // Of cells without pieces, in the fullest slab.
  bool tiles_fit = true;   // do_tiles_fit().
};

Cells cells_of(const std::shared_ptr<const LimitSolid>& shared_solid, const SliceJob& job, const LayerScope& scope,
               const CancellationToken& cancel) {
  const LimitSolid& solid = *shared_solid;
  const Placement voxel_of = voxel_of_mesh(job.placement, job.grid);
  const InterpolationSpec spec = interpolation_spec_of(job, solid.summary().channels);
  const bool tiles_fit = do_tiles_fit(shared_solid, spec, cancel);
  const SmallCells small(shared_solid, voxel_of.inverse(Eigen::Affine), tiles_fit);
  const double voxels_of_mm3 = std::abs(voxel_of.linear().determinant());
  const std::size_t slabs = job.grid.extent.layers / kSlabLayers + 1;
  IntervalSums pieces(slabs), runs(slabs), tile_voxels(slabs);
  std::array<std::vector<std::pair<LimitCellId, Box3>>, 2> cut;  // Regular cells, others.
  PeriodicPoll poll(cancel);
  for (const LimitCellId cell : solid.cells()) {
    poll();
    const Box3 box = solid.index().cell_boxes.box(cell).transformed(voxel_of);
    if (box.max().y() < scope.rows.begin || box.min().y() > scope.rows.end) continue;
    if (!small.contain(cell)) {
      cut[solid.cell_class(cell) == CellClass::kRegular ? 0 : 1].emplace_back(cell, box);
      continue;
    }
    const Vec3 size = box.sizes().cwiseMax(1);
    const double volume = std::min(solid.index().volume_mm3(cell) * voxels_of_mm3, size.prod());
    tile_voxels.add(std::floor(box.min().z() / kSlabLayers), std::floor(box.max().z() / kSlabLayers),
                    volume * std::min(1.0, kSlabLayers / size.z()));
  }
  CutCells cutter(shared_solid, spec);
  double all_pieces = 0;
  for (const auto& cells : cut) {
    const auto [cut_leaves, cut_runs] = cutter.cut(cells, cancel);
    const double leaves = kFiner * cut_leaves, each_way = std::cbrt(leaves);
    all_pieces += leaves * static_cast<double>(cells.size());
    for (const auto& [cell, box] : cells) {
      const double first = std::floor(box.min().z() / kSlabLayers), last = std::floor(box.max().z() / kSlabLayers);
      const Vec3 size = box.sizes().cwiseMax(1);
      pieces.add(first, last, leaves * std::min(1.0, kSlabLayers / size.z() + 1 / each_way));
      runs.add(first, last, cut_runs * size.y() * std::min<double>(size.z(), kSlabLayers));
    }
  }
  return {pieces.most(), all_pieces, runs.most(), tile_voxels.most(), tiles_fit};
}

/// What stays of a piece as long as it's known, and what a slab makes of it besides.
double piece_bytes(double channels) {
  return sizeof(CellPiece) + 2 * sizeof(CellNode) + channels * sizeof(CubicPolynomial);
}
double slab_piece_bytes(double channels) {
  return kGrowthOfPieces * (sizeof(SlabPiece) + 24 + channels * (sizeof(CubicPolynomial) + sizeof(CubicInLayer)));
}

/// What tiles are made of. Voxels of large cells may be left to tiles, too: those that no piece paints.
double particle_bytes(double channels) {
  return TileParticles::kMost * (sizeof(TileParticle) + channels * sizeof(BlockValues));
}

/// Patches of an evaluator.
double patches_of(const LimitSolid& solid, std::size_t most_bytes) {
  return static_cast<double>(patch_cache_bytes(solid.summary().channels.size(), most_bytes));
}

/// What a PartPainter takes that paints so many copies, one of so many painters.
SlicerMemory memory_of_part(const PlacedPart& part, std::size_t copies, std::size_t painters,
                            const CancellationToken& cancel) {
  const std::shared_ptr<const LimitSolid>& solid = part.solid;
  const SliceJob& job = part.job;
  const LayerScope scope = scope_of(job);
  const Boundary boundary = boundary_of(*solid, job, scope, cancel);
  const ChannelTable of_solid(solid->summary().channels);
  const double channels = static_cast<double>(std::ranges::count_if(
      all_channels(job), [&](const PlaneSpec& plane) { return of_solid.find(plane.channel).has_value(); }));
  const bool interpolates = channels > 0 && job.channel_tolerance != 0.0;
  const LayerWindow window = common_window(window_of_solid(solid->summary(), job), scope.window);
  double shared = boundary.faces * 2 * sizeof(Box3),
         slicer = source_bytes(job) + painted_bytes(job, window) + cut_bytes(job, window);
  slicer += contour_bytes(boundary, job, scope, interpolates ? kSlabLayers : 1);
  if (copies > 1) slicer += kGrowth * static_cast<double>(copies) * shape_bytes(boundary, job, scope);
  const std::size_t patch_bytes = VoxelBlocks::patch_bytes(painters);
  if (channels > 0) slicer += patches_of(*solid, patch_bytes);  // Of the inverter.
  std::optional<bool> tiles_fit;
  const CellIndex& index = solid->index();
  if (channels > 0 && index.fold_boxes.size() + index.overlap_boxes.size() > 0) slicer += kPartsOfInverter;
  if (interpolates) {
    const Cells cells = cells_of(solid, job, scope, cancel);
    tiles_fit = cells.tiles_fit;
    const double irregular = static_cast<double>(solid->cell_count() - solid->summary().regular_cells);
    // The store keeps the pieces that were asked for last, so those of slabs at hand are among them, if they fit.
    const double all_piece_bytes = cells.all_pieces * piece_bytes(channels);
    const double slab_bytes = std::min(cells.pieces * piece_bytes(channels), all_piece_bytes);
    const NodeStoreBytes most = bytes_of_store(painters);
    shared += std::max(std::min(static_cast<double>(most.pieces), all_piece_bytes) - slab_bytes, 0.0);
    shared += std::min(static_cast<double>(most.stencils), irregular * kStencilsOfCell);
    const auto line_bytes = static_cast<double>(VoxelBlocks::line_bytes(painters));
    slicer += patches_of(*solid, patch_bytes) + std::min(line_bytes, irregular * kLinesOfCell);
    slicer += slab_bytes + cells.pieces * slab_piece_bytes(channels);
    slicer += kGrowthOfPieces * cells.runs * (kRunBytes + sizeof(ScannedRun) / double{kSlabLayers});
    slicer += particle_bytes(channels);
    slicer += cells.tile_voxels / kVoxelsOfTile * (channels * sizeof(CubicPolynomial) + 256);
  }
  return {static_cast<std::uint64_t>(shared),
          static_cast<std::uint64_t>(slicer),
          static_cast<std::uint64_t>(boundary.rows),
          {tiles_fit}};
}

/// How many voxels of the job's region the part's box has, about.
double voxels_in_region(const PlacedPart& part) {
  const Box3 box = part.solid->summary().bounding_box.transformed(voxel_of_mesh(part.job.placement, part.job.grid));
  const VoxelBox region = region_of(part.job);
  const Vec3 first(region.first_column, region.first_row, region.first_layer);
  const Box3 common =
      box.intersection(Box3(first, first + Vec3(region.extent.columns, region.extent.rows, region.extent.layers)));
  return common.isEmpty() ? 0 : common.volume();
}

/// The maps that colours are looked up in are tables.
double map_bytes(const PlacedPart& part) {
  constexpr double kTable = 33 * 33 * 33 * 4 * sizeof(float);
  if (part.is_copy || !chooses_materials(part.job)) return 0;
  double bytes = 0;
  for (const MaterialMap* map : maps_of(*part.job.printing)) {
    if (std::holds_alternative<ColourMap>(map->kind)) bytes += kTable;
  }
  return bytes;
}

}  // namespace

SlicerMemory slicer_memory(const PlacedParts& parts, const CancellationToken& cancel) {
  // Groups of copies that differ by where they lie take about the same: that of which most is in the region stands for
  // all.
  const std::vector<CopyGroup> groups = copy_groups(parts);
  const auto painted = [&](std::size_t group) -> const PlacedPart& { return parts[groups[group].copies.front().part]; };
  const auto is_like = [&](std::size_t a, std::size_t b) {
    return painted(a).solid == painted(b).solid && painted(b).is_copy &&
           groups[a].copies.size() == groups[b].copies.size() &&
           lie_alike(painted(a).job.placement, painted(b).job.placement);
  };
  SlicerMemory memory;
  memory.tiles_fit.resize(parts.size());
  for (std::size_t first = 0, end = 0; first < groups.size(); first = end) {
    std::size_t fullest = first;
    for (end = first + 1; end < groups.size() && is_like(first, end); ++end) {
      if (voxels_in_region(painted(end)) > voxels_in_region(painted(fullest))) fullest = end;
    }
    PlacedPart part = painted(fullest);
    if (groups[first].is_shared()) part.job.region.reset();
    const SlicerMemory of_part = memory_of_part(part, groups[first].copies.size(), groups.size(), cancel);
    const std::uint64_t alike = end - first;
    memory.shared_bytes += alike * of_part.shared_bytes;
    if (parts.size() > 1) memory.shared_bytes += static_cast<std::uint64_t>(map_bytes(painted(first)));
    memory.slicer_bytes += alike * of_part.slicer_bytes;
    memory.crossings += alike * of_part.crossings;
    for (std::size_t group = first; group < end; ++group) {
      for (const CopyGroup::Copy& copy : groups[group].copies) memory.tiles_fit[copy.part] = of_part.tiles_fit.front();
    }
  }
  std::set<const ChannelSource*> sources;  // Parts share them.
  for (const PlacedPart& part : parts) {
    for (const UsedSource& use : used_sources(part.job)) {
      if (!sources.insert(use.source).second) continue;
      memory.shared_bytes += static_cast<std::uint64_t>(use.source->memory_bytes(cancel));
    }
  }
  const SliceJob& job = parts.front().job;
  const LayerWindow window = window_of_parts(parts);
  double composed = encoded_bytes(job, window);
  if (parts.size() > 1) {
    const LayerWindow held = common_window(window, region_of(job).window());
    if (chooses_materials(job)) composed += voxels_of(held);
    for (const PlaneSpec& plane : shown_channels(job)) composed += plane_bytes(plane, held);
  }
  memory.slicer_bytes += static_cast<std::uint64_t>(composed);
  return memory;
}

SlicerMemory slicer_memory(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                           const CancellationToken& cancel) {
  return slicer_memory(PlacedParts{{"", solid, job}}, cancel);
}

}  // namespace ccslice
