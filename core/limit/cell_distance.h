// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Proof that a cell's limit comes nowhere near a point.
//
// Newton's method in a cell that doesn't hold the point ends somewhere, and then begins again elsewhere: that it fails
// proves nothing. The control points of a patch do: the patch lies in their hull, and what is on the far side of a
// plane holds nothing on the near side. The planes tried here are those of a box about the hull, sheared as the patch
// is in its middle, where patches are nearly cubes. A patch whose box holds the point is halved, and its halves, whose
// boxes are closer by the square, are looked at in turn. Beside irregular lines and vertices whole levels of patches
// are left out by the points that they all depend on.
//
// A cell that is asked about again gets boxes around its parts, which most points that are off it are off as well. They
// save time and change no answer that matters: what they say is true as well.

#pragma once

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/limit/cell_hulls.h"
#include "core/limit/limit_solid.h"
#include "core/limit/patch_path.h"

namespace ccslice {

/// One solid, one thread.
class CellDistance {
 public:
  /// REQUIRES: the solid outlives this.
  explicit CellDistance(const LimitSolid& solid);

  /// True only if the cell's limit is nowhere within `distance_mm` of the point, mesh frame. False also where that
  /// would take too long to tell: beside the cell, within about a hundredth of it. REQUIRES: distance_mm is more than
  /// doubles are off at the size of the solid.
  [[nodiscard]] bool exceeds(LimitCellId cell, const Vec3& point, double distance_mm) noexcept;

 private:
  bool is_off_parts(LimitCellId cell, const Vec3& point, double distance_mm) noexcept;

  const LimitSolid& solid_;
  PatchBuilder builder_;
  std::vector<Eigen::Vector4d> images_;
  std::unordered_map<std::uint32_t, CellHulls> parts_;  // By cell: none yet of those that were asked about once.
  std::size_t parts_bytes_ = 0;
};

}  // namespace ccslice
