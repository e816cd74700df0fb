// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/cut_estimates.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/interpolation/samples/voxel_blocks.h"

namespace ccslice {
namespace {

// How many cells or faces are cut, at most, and for how many planes each face.
constexpr std::size_t kPicked = 24, kPlanes = 8;

// Tall pieces are scanned in so many bands of layers, which a scan takes four at a time.
constexpr std::uint32_t kBands = 4, kBandLayers = 4;

/// Calls visit(thing) for some of the things; returns how many. Chance picks one of each part of the list: things in it
/// often repeat at even steps, as the faces of a row of cells do.
template <class Things, class Visit>
std::size_t visit_some(const Things& things, std::minstd_rand& chance, const CancellationToken& cancel, Visit visit) {
  const std::size_t count = std::min(things.size(), kPicked);
  for (std::size_t k = 0; k < count; ++k) {
    cancel.throw_if_cancelled();
    const std::size_t begin = things.size() * k / count, end = things.size() * (k + 1) / count;
    visit(things[begin + chance() % (end - begin)]);
  }
  return count;
}

}  // namespace

CutCells::CutCells(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec)
    : grid_(spec.grid), fitter_(solid, spec) {}

CutCells::Cut CutCells::cut(std::span<const std::pair<LimitCellId, Box3>> cells, const CancellationToken& cancel) {
  double leaves = 0, runs = 0, rows = 0;
  const std::size_t count = visit_some(cells, chance_, cancel, [&](const auto& picked) {
    const auto& [cell, box] = picked;
    const Vec3 size = box.sizes().cwiseMax(1);
    rows += size.y() * size.z();
    descend(cell, box, leaves, runs);
  });
  return count == 0 ? Cut{} : Cut{leaves / static_cast<double>(count), runs / rows};
}

/// Adds what the cell is cut into, and the runs of its pieces.
void CutCells::descend(LimitCellId cell, const Box3& box, double& leaves, double& runs) {
  std::vector<CellNode> nodes(1);
  nodes[0].bounds = Box3(box.min() - Vec3::Ones(), box.max() + Vec3::Ones());
  double weight = 1;
  for (std::uint32_t at = 0;;) {
    fitter_.examine(cell, nodes, at);
    const CellNode& node = nodes[at];
    const std::uint32_t children = node.end_child - node.first_child;
    if (node.kind == CellNode::Kind::kHalved && children > 0) {
      weight *= children;
      at = node.first_child + static_cast<std::uint32_t>(chance_() % children);
      continue;
    }
    leaves += weight;
    if (node.kind != CellNode::Kind::kPiece) return;
    runs += weight * runs_of(*node.piece);
    return;
  }
}

double CutCells::runs_of(const CellPiece& piece) {
  double low = piece.points.front().z(), high = low;
  for (const Vec3& point : piece.points) {
    low = std::min(low, point.z());
    high = std::max(high, point.z());
  }
  const auto layer = [&](double z) {
    return static_cast<std::uint32_t>(std::clamp(z, 0.0, grid_.extent.layers * 1.0));
  };
  const std::uint32_t begin = layer(std::ceil(low)), end = layer(std::floor(high) + 1);
  const std::uint32_t layers = end - begin;
  const auto scan = [&](std::uint32_t first, std::uint32_t past) {
    raster_.scan(piece.points, piece.step, {grid_.extent.columns, grid_.extent.rows, first, past}, scanned_);
  };
  scanned_.clear();
  if (layers <= 2 * kBands * kBandLayers) {
    scan(begin, end);
    return static_cast<double>(scanned_.size());
  }
  for (std::uint32_t band = 0; band < kBands; ++band) {
    const std::uint32_t first = begin + layers * (2 * band + 1) / (2 * kBands) - kBandLayers / 2;
    scan(first, first + kBandLayers);
  }
  return static_cast<double>(scanned_.size()) * layers / (kBands * kBandLayers);
}

CutFaces::CutFaces(const LimitSolid& solid, const SliceJob& job) : job_(job), surface_(solid), leaves_(surface_) {
  criteria_.to_axes = {job.placement.linear(), job.placement.translation()};
  criteria_.tolerance_mm = job.contour_tolerance_mm;
  criteria_.small_mm = 0.5 * std::min(job.grid.pitch.x_mm, job.grid.pitch.y_mm);
}

CutFaces::Cut CutFaces::cut(std::span<const BoundaryFaceId> faces, const CancellationToken& cancel) {
  const VoxelBox region = region_of(job_);
  const double first_mm = job_.grid.layer_z_mm(region.first_layer);
  const double last_mm = job_.grid.layer_z_mm(region.first_layer + region.extent.layers - 1);
  Cut sums;
  double layers = 0, hull_rows = 0;  // That the faces' hulls are in.
  const std::size_t count = visit_some(faces, chance_, cancel, [&](BoundaryFaceId face) {
    const Box3 hull = surface_.hull_box(face).transformed(job_.placement);
    const double low = std::clamp(hull.min().z(), first_mm, last_mm);
    const double high = std::clamp(hull.max().z(), first_mm, last_mm);
    // Each plane stands for as many layers: tall faces are met by more of them.
    const double weight = ((high - low) / job_.grid.pitch.z_mm + 1) / kPlanes;
    std::size_t nodes_before = leaves_.kept_nodes();
    for (std::size_t k = 0; k < kPlanes; ++k) {
      criteria_.height_mm = low + (high - low) * (static_cast<double>(k) + 0.5) / kPlanes;
      leaves_.collect({&face, 1}, criteria_);
      layers += weight;
      hull_rows += weight * (hull.sizes().y() / job_.grid.pitch.y_mm + 1);
      sums.visited += weight * static_cast<double>(leaves_.visited_nodes());
      for (const ContourLeaf& leaf : leaves_.leaves()) {
        if (!is_crossed(leaf)) continue;
        const LeafSurface surface = leaves_.surface(leaf);
        const auto [low_y, high_y] = hull_of(surface.net.y);
        sums.rows += weight * ((high_y - low_y) / job_.grid.pitch.y_mm + 1);
        const double chords = std::sqrt(surface.node.chord.whole() / criteria_.tolerance_mm);
        sums.points += weight * std::exp2(std::max(0.0, std::ceil(std::log2(chords))));  // Each is halved.
      }
    }
    if (leaves_.kept_nodes() < nodes_before) nodes_before = 0;  // They were forgotten.
    sums.nodes += static_cast<double>(leaves_.kept_nodes() - nodes_before);
  });
  if (count == 0) return {};
  return {sums.nodes / static_cast<double>(count), sums.visited / layers, sums.points / layers, sums.rows / hull_rows};
}

bool CutFaces::is_crossed(const ContourLeaf& leaf) const {
  const std::array<std::uint32_t, 4>& corners = leaves_.surface(leaf).node.corners;
  return !leaf.resolved || std::ranges::any_of(corners, [&](std::uint32_t corner) {
    return leaves_.side(corner) != leaves_.side(corners[0]);
  });
}

}  // namespace ccslice
