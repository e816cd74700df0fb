// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slicer_memory.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <optional>
#include <random>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "core/channel/channel_source.h"
#include "core/channel/channel_table.h"
#include "core/contour/contour.h"
#include "core/contour/surface_tree.h"
#include "core/interpolation/pieces/cell_fitter.h"
#include "core/interpolation/pieces/slab_pieces.h"
#include "core/interpolation/samples/small_cells.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/interpolation/tiles/tile_particles.h"
#include "core/interpolation/tiles/tile_trials.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/cell_index.h"
#include "core/output/encode.h"
#include "core/output/encodings.h"
#include "core/slicer/channel_tolerances.h"
#include "core/slicer/layer_scope.h"
#include "core/slicer/part_planes.h"

namespace ccslice {
namespace {

constexpr double kMiB = 1 << 20;

// Vectors that grow are half empty and, while they are moved, there twice.
constexpr double kGrowth = 2, kGrowthOfPieces = 1.5;

// What codecs, inverters and fitters keep at most, whatever the job.
constexpr double kCodecs = 4 * kMiB;
constexpr double kPatchesOfInverter = 11 * kMiB, kPatchesOfFitters = 22 * kMiB;
constexpr double kPartsOfInverter = 5 * kMiB;  // Where the solid folds, or parts of it overlap.
constexpr double kLines = 2 * 8 * kMiB, kLinesOfCell = 5.4 * 1024;
constexpr double kPiecesOfJob = 48 * kMiB, kStencilsOfJob = 2 * 16 * kMiB, kStencilsOfCell = 10.8 * 1024;

// Of contours: points are there as crossings, between them, and in loops.
constexpr double kCopiesOfPoints = 3, kFewestPoints = 4;
constexpr double kNodesOfCutFace = 1.5, kMostNodesOfRegular = 6, kMostNodesOfIrregular = 96;
constexpr double kNodeBytes = sizeof(SurfaceNode) + sizeof(BezierNet) + 160;  // With vertices and marks.

// How finely cells are cut is found out for some of them: others may be cut more finely.
constexpr std::size_t kDescents = 24;
constexpr double kFiner = 1.25, kVoxelsOfTile = 128;
constexpr double kRunBytes = sizeof(ScannedRun) + sizeof(PieceRun) + sizeof(VoxelRun);  // Scanned, painted, unpainted.

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
  double bytes = shows_materials(job) ? voxels_of(window) : 0;
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
    if (plane.content == PlaneContent::kMaterials || plane.content == PlaneContent::kMaterialMask ||
        plane.content == PlaneContent::kCellRegions) {
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
  for (const ChannelSource* source : used_sources(job)) {
    most = std::max(most, 1.0 + static_cast<double>(source->inputs().size()));
  }
  return kGrowth * most * job.grid.extent.columns * sizeof(float);
}

/// What planes and rows meet of the boundary.
struct Boundary {
  double faces = 0;   // In all,
  double cut = 0;     // and at most by one plane.
  double nodes = 0;   // That its faces can be halved into, at most.
  double points = 0;  // Of its contours.
  double rows = 0;    // Of all its faces that are cut, one after the other.
};

Boundary boundary_of(const LimitSolid& solid, const SliceJob& job, const LayerScope& scope,
                     const CancellationToken& cancel) {
  const BoundarySurface surface(solid);
  const Placement voxel_of = voxel_of_mesh(job.placement, job.grid);
  const VoxelBox region = region_of(job);
  double nodes = 0;
  IntervalSums cut(region.extent.layers), points(region.extent.layers), rows(region.extent.layers);
  PeriodicPoll poll(cancel);
  const IdRange<BoundaryFaceId> faces(surface.faces_and_interfaces().size());
  const double scale = job.placement.linear().norm();
  for (const BoundaryFaceId face : faces) {
    poll();
    const Box3& hull = surface.hull_box(face);
    const Box3 voxels = hull.transformed(voxel_of);
    const double low = std::floor(voxels.min().z() - region.first_layer) - 1;
    const double high = std::ceil(voxels.max().z() - region.first_layer) + 1;
    cut.add(low, high, 1);
    nodes += surface.faces_and_interfaces()[face].regular ? kMostNodesOfRegular : kMostNodesOfIrregular;
    points.add(low, high, kFewestPoints + std::sqrt(hull.diagonal().norm() * scale / (4 * job.contour_tolerance_mm)));
    const double first_row = std::max<double>(voxels.min().y(), scope.rows.begin);
    const double end_row = std::min<double>(voxels.max().y(), scope.rows.end);
    rows.add(low, high, std::max(0.0, end_row - first_row) + 1);
  }
  return {static_cast<double>(faces.size()), cut.most(), nodes, points.most(), rows.most()};
}

/// `kept_layers`: those whose spans and contours are kept.
double contour_bytes(const Boundary& boundary, const SliceJob& job, const LayerScope& scope, double kept_layers) {
  const double visited = kNodesOfCutFace * boundary.cut;
  const double nodes = std::min(std::max<double>(SurfaceTree::kKeptNodes, 8 * visited) + visited, boundary.nodes);
  const double loops = boundary.points * sizeof(ContourPoint);
  const double crossings =
      std::min(boundary.rows, std::max<double>(1 << 20, 4 * boundary.points)) * sizeof(std::uint64_t);
  const double row_begins = 8.0 * job.grid.extent.rows;
  const double rows = scope.rows.end - scope.rows.begin;
  const double spans =
      std::min(boundary.rows / 2 + rows, rows * (job.grid.extent.columns / 2 + 1.0)) * sizeof(VoxelRun);
  const bool has_regions = shows_cell_regions(job) || (job.printing && !job.printing->cell_region_maps.empty());
  const double kept = (has_regions ? 3 : 1) * spans + (job.contours ? loops : 0);
  return kGrowth * (nodes * kNodeBytes + kCopiesOfPoints * loops + kept_layers * kept) + crossings + row_begins;
}

/// What slabs meet of the cells.
struct Cells {
  double pieces = 0;       // In the fullest slab.
  double all_pieces = 0;   // Of all slabs.
  double runs = 0;         // Of pieces, in a layer of it.
  double tile_voxels = 0;  // Of cells without pieces, in the fullest slab.
  bool tiles_fit = true;   // do_tiles_fit().
};

/// How many pieces and holes cells of one class are cut into on average: some of them are followed down their trees, to
/// a child that chance picks each time, which stands for all children [Knuth 1975, Estimating the efficiency of
/// backtrack programs].
class CutCells {
 public:
  CutCells(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec) : fitter_(solid, spec) {}

  double leaves_of(std::span<const std::pair<LimitCellId, Box3>> cells, const CancellationToken& cancel) {
    double leaves = 0;
    for (std::size_t k = 0; k < kDescents && !cells.empty(); ++k) {
      cancel.throw_if_cancelled();
      const auto& [cell, box] = cells[cells.size() * k / kDescents];
      leaves += descend(cell, box);
    }
    return leaves / kDescents;
  }

 private:
  double descend(LimitCellId cell, const Box3& box) {
    std::vector<CellNode> nodes(1);
    nodes[0].bounds = Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
    double leaves = 1;
    for (std::uint32_t at = 0;;) {
      fitter_.examine(cell, nodes, at);
      const std::uint32_t children = nodes[at].end_child - nodes[at].first_child;
      if (nodes[at].kind != CellNode::Kind::kHalved || children == 0) return leaves;
      leaves *= children;
      at = nodes[at].first_child + static_cast<std::uint32_t>(chance_() % children);
    }
  }

  CellFitter fitter_;
  std::minstd_rand chance_;
};

Cells cells_of(const std::shared_ptr<const LimitSolid>& shared_solid, const SliceJob& job, const LayerScope& scope,
               const CancellationToken& cancel) {
  const LimitSolid& solid = *shared_solid;
  const Placement voxel_of = voxel_of_mesh(job.placement, job.grid);
  const InterpolationSpec spec = interpolation_spec_of(job, solid.summary().channels);
  const bool tiles_fit = do_tiles_fit(shared_solid, spec);
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
    const double leaves = kFiner * cutter.leaves_of(cells, cancel), each_way = std::cbrt(leaves);
    all_pieces += leaves * static_cast<double>(cells.size());
    for (const auto& [cell, box] : cells) {
      const double first = std::floor(box.min().z() / kSlabLayers), last = std::floor(box.max().z() / kSlabLayers);
      const Vec3 size = box.sizes().cwiseMax(1);
      pieces.add(first, last, leaves * std::min(1.0, kSlabLayers / size.z() + 1 / each_way));
      runs.add(first, last, each_way * size.y());
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

/// What a PartPainter takes.
SlicerMemory memory_of_part(const PlacedPart& part, const CancellationToken& cancel) {
  const std::shared_ptr<const LimitSolid>& solid = part.solid;
  const SliceJob& job = part.job;
  const LayerScope scope = scope_of(job);
  const Boundary boundary = boundary_of(*solid, job, scope, cancel);
  const ChannelTable of_solid(solid->summary().channels);
  const double channels = static_cast<double>(std::ranges::count_if(
      all_channels(job), [&](const PlaneSpec& plane) { return of_solid.find(plane.channel).has_value(); }));
  const bool interpolates = channels > 0 && job.channel_tolerance != 0.0;
  double shared = boundary.faces * 2 * sizeof(Box3),
         slicer = source_bytes(job) +
                  painted_bytes(job, common_window(window_of_solid(solid->summary(), job), scope.window));
  slicer += contour_bytes(boundary, job, scope, interpolates ? kSlabLayers : 1);
  if (channels > 0) slicer += kPatchesOfInverter;
  std::optional<bool> tiles_fit;
  const CellIndex& index = solid->index();
  if (channels > 0 && index.fold_boxes.size() + index.overlap_boxes.size() > 0) slicer += kPartsOfInverter;
  if (interpolates) {
    const Cells cells = cells_of(solid, job, scope, cancel);
    tiles_fit = cells.tiles_fit;
    const double irregular = static_cast<double>(solid->cell_count() - solid->summary().regular_cells);
    const double all_piece_bytes = cells.all_pieces * piece_bytes(channels);
    shared += std::min(kPiecesOfJob, all_piece_bytes) + std::min(kStencilsOfJob, irregular * kStencilsOfCell);
    slicer += kPatchesOfFitters + std::min(kLines, irregular * kLinesOfCell);
    slicer += cells.pieces * slab_piece_bytes(channels);
    if (all_piece_bytes > kPiecesOfJob) slicer += cells.pieces * piece_bytes(channels);  // Forgotten by others.
    slicer += kGrowthOfPieces * cells.runs * (kSlabLayers * kRunBytes + sizeof(ScannedRun));
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
  if (part.is_copy || !shows_materials(part.job)) return 0;
  double bytes = 0;
  for (const MaterialMap* map : maps_of(*part.job.printing)) {
    if (std::holds_alternative<ColourMap>(map->kind)) bytes += kTable;
  }
  return bytes;
}

}  // namespace

SlicerMemory slicer_memory(const PlacedParts& parts, const CancellationToken& cancel) {
  // Copies that differ by where they lie take about the same: that of which most is in the region stands for all.
  const auto is_like = [&](std::size_t a, std::size_t b) {
    return parts[a].solid == parts[b].solid && parts[b].is_copy &&
           lie_alike(parts[a].job.placement, parts[b].job.placement);
  };
  SlicerMemory memory;
  for (std::size_t first = 0, end = 0; first < parts.size(); first = end) {
    std::size_t fullest = first;
    for (end = first + 1; end < parts.size() && is_like(first, end); ++end) {
      if (voxels_in_region(parts[end]) > voxels_in_region(parts[fullest])) fullest = end;
    }
    const SlicerMemory of_part = memory_of_part(parts[fullest], cancel);
    const std::uint64_t copies = end - first;
    memory.shared_bytes += copies * of_part.shared_bytes;
    if (parts.size() > 1) memory.shared_bytes += static_cast<std::uint64_t>(map_bytes(parts[first]));
    memory.slicer_bytes += copies * of_part.slicer_bytes;
    memory.crossings += copies * of_part.crossings;
    memory.tiles_fit.insert(memory.tiles_fit.end(), copies, of_part.tiles_fit.front());
  }
  const SliceJob& job = parts.front().job;
  const LayerWindow region = region_of(job).window();
  const double composed = parts.size() == 1 ? encoded_bytes(job, window_of_solid(parts.front().solid->summary(), job))
                                            : encoded_bytes(job, region) + painted_bytes(job, region);
  memory.slicer_bytes += static_cast<std::uint64_t>(composed);
  return memory;
}

SlicerMemory slicer_memory(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                           const CancellationToken& cancel) {
  return slicer_memory(PlacedParts{{"", solid, job}}, cancel);
}

}  // namespace ccslice
