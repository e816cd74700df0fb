// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/copies.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>

#include "core/channel/channel_source.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/raster/occupancy.h"

namespace ccslice {
namespace {

Vec3 steps_of(const VoxelPitch& pitch) { return Vec3(pitch.x_mm, pitch.y_mm, pitch.z_mm); }

/// All voxels whose centres are in the part's box lie between the sides of the grid. Contours may be wider than the
/// part by their tolerance.
bool is_uncut(const PlacedPart& part) {
  const LayerLattice lattice = part.job.grid.lattice();
  const Box3 box = part.solid->summary().bounding_box.transformed(part.job.placement);
  const double wider = part.job.contour_tolerance_mm;
  const auto fits = [&](int axis, double from_mm, double step_mm, std::uint32_t voxels) {
    constexpr double kToCentre = 0.5;
    const double first = std::ceil((box.min()[axis] - wider - from_mm) / step_mm - kToCentre);
    const double last = std::floor((box.max()[axis] + wider - from_mm) / step_mm - kToCentre);
    return first >= 0 && last < voxels;
  };
  return fits(0, lattice.x0_mm, lattice.dx_mm, lattice.width) && fits(1, lattice.y0_mm, lattice.dy_mm, lattice.height);
}

/// From one copy to another that lies alike; nothing unless it is whole columns and rows within the same layers.
std::optional<VoxelShift> shift_between(const PlacedPart& from, const PlacedPart& to) {
  constexpr double kSame = 1e-6;  // Voxels: sums of doubles are far nearer, and contours are farther from the surface.
  const Vec3 moved = to.job.placement.translation() - from.job.placement.translation();
  const Vec3 voxels = moved.cwiseQuotient(steps_of(from.job.grid.pitch));
  const Vec3 whole = voxels.array().round();
  if (whole.z() != 0 || !((voxels - whole).cwiseAbs().maxCoeff() < kSame)) return std::nullopt;
  return VoxelShift{static_cast<std::int32_t>(whole.x()), static_cast<std::int32_t>(whole.y())};
}

/// Columns and rows that stay in the grid when they are moved.
LayerWindow window_before(const VoxelShift& shift, const LayerWindow& grid) {
  const auto begin = [](std::uint32_t end, std::int32_t by) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(-std::int64_t{by}, 0, end));
  };
  const auto end = [](std::uint32_t end, std::int32_t by) {
    return static_cast<std::uint32_t>(std::clamp<std::int64_t>(std::int64_t{end} - by, 0, end));
  };
  const std::uint32_t column = begin(grid.columns, shift.columns), row = begin(grid.rows, shift.rows);
  return {column, row, std::max(column, end(grid.columns, shift.columns)) - column,
          std::max(row, end(grid.rows, shift.rows)) - row};
}

bool follow_part(const ChannelSources& sources) {
  return std::ranges::all_of(sources, [](const auto& source) { return source->follows_part(); });
}

}  // namespace

SnappedCopies snap_copies(PlacedParts& parts, const VoxelPitch& pitch) {
  constexpr double kAlikeMm = 1e-4, kMovedMm = 1e-6;
  const Vec3 step = steps_of(pitch);
  SnappedCopies snapped;
  std::vector<const Placement*> firsts;  // Of the part at hand: one for each way that copies lie.
  for (PlacedPart& part : parts) {
    if (!part.is_copy) firsts.clear();
    Placement& placement = part.job.placement;
    const Box3& box = part.solid->summary().bounding_box;
    const auto first = std::ranges::find_if(firsts, [&](const Placement* other) {
      const Mat3 apart = other->linear() - placement.linear();
      return (apart.cwiseAbs() * (0.5 * box.sizes())).maxCoeff() < kAlikeMm;
    });
    if (first == firsts.end()) {
      firsts.push_back(&placement);
      continue;
    }
    const Vec3 from = **first * box.center(), to = placement * box.center();
    const Vec3 voxels = (to - from).cwiseQuotient(step).array().round();
    placement.linear() = (*first)->linear();
    placement.translation() = (*first)->translation() + voxels.cwiseProduct(step);
    const Vec3 moved = (placement * box.center() - to).cwiseAbs();
    if (moved.maxCoeff() > kMovedMm) ++snapped.copies;
    snapped.most_mm = snapped.most_mm.cwiseMax(moved);
  }
  return snapped;
}

std::vector<CopyGroup> copy_groups(const PlacedParts& parts) {
  std::vector<CopyGroup> groups;
  std::vector<std::size_t> shared;  // Groups of the part at hand that copies may join.
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    const PlacedPart& part = parts[p];
    if (!part.is_copy) shared.clear();
    const LayerWindow grid = window_of(part.job.grid.lattice());
    const bool may_share = part.job.snap_copies && follow_part(part.job.sources) && is_uncut(part);
    const auto joins = [&](std::size_t number) {
      CopyGroup& group = groups[number];
      const PlacedPart& painted = parts[group.copies.front().part];
      if (!lie_alike(painted.job.placement, part.job.placement)) return false;
      const auto shift = shift_between(painted, part);
      if (!shift) return false;
      group.copies.push_back({p, *shift});
      group.within = common_window(group.within, window_before(*shift, grid));
      return true;
    };
    if (may_share && std::ranges::any_of(shared, joins)) continue;
    if (may_share) shared.push_back(groups.size());
    groups.push_back({{{p, {}}}, grid});
  }
  return groups;
}

}  // namespace ccslice
