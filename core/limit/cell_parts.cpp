// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_parts.h"

#include <algorithm>
#include <array>

#include "core/limit/fold_search.h"
#include "core/limit/patch.h"

namespace ccslice {
namespace {

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

}  // namespace

std::size_t part_count(const LimitCell& cell, const PartSizes& sizes, PatchBuilder& builder) {
  std::size_t count = 0;
  const auto on_patch = [&](const PatchPath& path, const double*) {
    const auto [u, v, w] = halvings_of(cell, path, sizes.halvings);
    count += std::size_t{1} << (u + v + w);
  };
  builder.visit_patches(cell, sizes.levels, sizes.levels, on_patch, [&](const PatchRest&) { ++count; });
  return count;
}

void append_parts(const CellMap& map, const LimitCell& cell, const PartSizes& sizes, PatchBuilder& builder,
                  CellHulls& parts) {
  const auto on_patch = [&](const PatchPath& path, double* grid) {
    bspline_to_bezier(grid, 3, kPositionDimension);
    // The map is affine: the net of the image is the image of the net.
    BezierVolume net;
    for (std::size_t p = 0; p < 64; ++p) {
      const Vec3 guess = map(Vec3::Map(grid + kPositionDimension * p));
      net[p] = {guess.x(), guess.y(), guess.z(), 0};
    }
    append_pieces(net, halvings_of(cell, path, sizes.halvings), parts);
  };
  builder.visit_patches(cell, sizes.levels, sizes.levels, on_patch, [&](const PatchRest& rest) {
    Box3 box;
    rest.visit_hull([&](Lanes point) { box.extend(map(to_vec3(point))); });
    parts.append(box);
  });
}

}  // namespace ccslice
