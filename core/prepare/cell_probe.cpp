// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/cell_probe.h"

#include <algorithm>
#include <limits>

#include "core/limit/cell_index.h"
#include "core/limit/newton.h"

namespace ccslice {

std::optional<PlaceInCell> CellProbe::find(LimitCellId cell, const Vec3& point) noexcept {
  constexpr double kFromFaces = 0.02;
  constexpr std::uint64_t kBoxesOfAPoint = 32;
  ++work_;
  const CellMap map = solid_.index().cell_maps[cell];
  const Vec3 guess = map(point);
  if (!map.may_hold(guess, 0)) return std::nullopt;
  work_ += kBoxesOfAPoint;
  const Vec3 start = guess.cwiseMax(kFromFaces).cwiseMin(1 - kFromFaces);
  const NewtonResult found = newton_in_cell(evaluator_, cell, start, point, acceptance_);
  if (!found.accepted) return std::nullopt;
  const Mat3 inverse_jacobian = evaluator_.sample({cell, found.uvw}).jacobian.inverse();
  PlaceInCell place{found.uvw, std::numeric_limits<double>::infinity(), inverse_jacobian};
  const unsigned sides = solid_.boundary_sides(cell);
  for (int side = 0; side < 6; ++side) {
    if (!(sides >> side & 1)) continue;
    const double along = found.uvw[side / 2], way = side % 2 == 1 ? 1 - along : along;
    const double depth_mm = way / inverse_jacobian.row(side / 2).norm();
    if (!(depth_mm > kLeastOverlapMm)) return std::nullopt;
    place.depth_mm = std::min(place.depth_mm, depth_mm);
  }
  return place;
}

}  // namespace ccslice
