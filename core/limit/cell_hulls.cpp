// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_hulls.h"

#include "core/limit/fold_search.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {
namespace {

constexpr float kFloatRounding = 1e-5F;  // Rounding of floats near 1, with room.
constexpr int kLevels = 2;               // Levels of an irregular cell's patches that get hulls of their own.
constexpr std::uint32_t kCancelPeriod = 256;

/// Halvings along each axis.
using Halvings = std::array<int, 3>;

void append_pieces(const BezierVolume& net, Halvings left, CellHulls& parts) {
  std::size_t axis = 0;
  while (axis < 3 && left[axis] == 0) ++axis;
  if (axis == 3) {
    Box3 box;
    for (const Eigen::Vector4d& p : net) box.extend(p.head<3>());
    return parts.append(box);
  }
  --left[axis];
  BezierVolume low, high;
  halve_net(net, axis, low, high);
  append_pieces(low, left, parts);
  append_pieces(high, left, parts);
}

/// How often to halve a patch along each axis, so that all parts are about as large.
Halvings halvings_of(const LimitCell& cell, const PatchPath& path, int halvings) {
  if (cell.cell_class == CellClass::kRegular) return {halvings, halvings, halvings};
  const int across = std::max(0, halvings - 1 - path.level - path.line_level - (path.level > 0 || path.line_child > 0));
  const bool whole_length = cell.cell_class == CellClass::kLine;
  return {across, across, whole_length ? halvings : across};
}

void append_parts(const CellMap& map, const LimitCell& cell, int halvings, PatchBuilder& builder, CellHulls& parts) {
  const auto on_patch = [&](const PatchPath& path, double* grid) {
    bspline_to_bezier(grid, 3, kPositionDimension);
    // The map is affine: the net of the image is the image of the net.
    BezierVolume net;
    for (std::size_t p = 0; p < 64; ++p) {
      const Vec3 guess = map(Vec3::Map(grid + kPositionDimension * p));
      net[p] = {guess.x(), guess.y(), guess.z(), 0};
    }
    append_pieces(net, halvings_of(cell, path, halvings), parts);
  };
  builder.visit_patches(cell, kLevels, kLevels, on_patch, [&](const PatchRest& rest) {
    Box3 box;
    rest.visit_hull([&](const Vec3& point) { box.extend(map(point)); });
    parts.append(box);
  });
}

/// Empty if there would be too many.
CellHulls hulls_near(const LimitSolid::Data& data, const std::vector<bool>& near, int halvings,
                     const CancellationToken& cancel) {
  const std::size_t most = CellHulls::kMost + CellHulls::kMostPerCell * data.cells.size();
  PatchBuilder builder(data, kPositionDimension);
  CellHulls parts;
  for (const LimitCellId c : IdRange<LimitCellId>(data.cells.size())) {
    if (c % kCancelPeriod == 0) cancel.throw_if_cancelled();
    parts.start_cell();
    if (near[c]) append_parts(data.cell_maps[c], data.cells[c], halvings, builder, parts);
    if (parts.size() > most) return {};
  }
  parts.finish();
  return parts;
}

}  // namespace

void CellHulls::append(const Box3& part) {
  parts_.push_back({part.min().cast<float>().array() - kFloatRounding * (1 + part.min().cast<float>().array().abs()),
                    part.max().cast<float>().array() + kFloatRounding * (1 + part.max().cast<float>().array().abs())});
}

void CellHulls::finish() {
  start_cell();
  parts_.shrink_to_fit();
}

void find_hulls_near_folds(const CancellationToken& cancel, LimitSolid::Data& data) {
  if (data.fold_boxes.size() == 0) return;
  std::vector<bool> near;
  for (const LimitCellId c : IdRange<LimitCellId>(data.cells.size())) {
    near.push_back(data.fold_boxes.any_meeting(data.cell_boxes.box(c), [](std::uint32_t) { return true; }));
  }
  for (int halvings = 2; halvings > 0 && data.hulls_near_folds.size() == 0; --halvings) {
    data.hulls_near_folds = hulls_near(data, near, halvings, cancel);
  }
}

}  // namespace ccslice
