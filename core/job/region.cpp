// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/job/region.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/error.h"
#include "core/base/number_text.h"

namespace ccslice {
namespace {

/// One axis of a grid and of a region.
struct RegionAxis {
  const char* name;  // "x", ...
  const char* first_field;
  const char* count_field;
  const char* voxels;  // What its voxels are called.
  double origin_mm, pitch_mm;
  std::uint32_t grid_count;
};

std::array<RegionAxis, 3> axes_of(const Grid& grid) {
  const Vec3& origin = grid.origin_mm;
  return {{{"x", "region.voxels.first_column", "region.voxels.extent.columns", "columns", origin.x(), grid.pitch.x_mm,
            grid.extent.columns},
           {"y", "region.voxels.first_row", "region.voxels.extent.rows", "rows", origin.y(), grid.pitch.y_mm,
            grid.extent.rows},
           {"z", "region.voxels.first_layer", "region.voxels.extent.layers", "layers", origin.z(), grid.pitch.z_mm,
            grid.extent.layers}}};
}

/// Voxels [first, end) of an axis.
using AxisRange = std::pair<std::uint32_t, std::uint32_t>;

std::string ends_of(const RegionAxis& axis) {
  return number_text(axis.origin_mm) + " to " + number_text(axis.origin_mm + axis.pitch_mm * axis.grid_count) + " mm";
}

/// The first voxel of the axis whose centre is not below `at_mm`, or how many there are.
std::uint32_t first_centre_from(const RegionAxis& axis, double at_mm) {
  const auto centre = [&](double i) { return axis.origin_mm + (i + 0.5) * axis.pitch_mm; };
  const double count = axis.grid_count;
  double index = std::clamp(std::floor((at_mm - axis.origin_mm) / axis.pitch_mm - 0.5), 0.0, count);
  while (index > 0 && centre(index - 1) >= at_mm) --index;
  while (index < count && centre(index) < at_mm) ++index;
  return static_cast<std::uint32_t>(index);
}

void require_finite(double value, const std::string& field) {
  if (std::isfinite(value)) return;
  throw Error(ErrorCode::kRegionNonFinite, field + ": NaN or infinite; give the box's corners in mm", field);
}

AxisRange voxels_between(const RegionAxis& axis, double low_mm, double high_mm) {
  require_finite(low_mm, std::string("region.box_mm.min_mm.") + axis.name);
  require_finite(high_mm, std::string("region.box_mm.max_mm.") + axis.name);
  const std::string field = "region.box_mm", box = number_text(low_mm) + " to " + number_text(high_mm) + " mm";
  if (!(low_mm < high_mm)) {
    throw Error(ErrorCode::kRegionEmpty,
                field + ": empty along " + axis.name + " (" + box + "); its min_mm must be below its max_mm", field);
  }
  if (high_mm <= axis.origin_mm || low_mm >= axis.origin_mm + axis.pitch_mm * axis.grid_count) {
    throw Error(
        ErrorCode::kRegionOutOfGrid,
        field + ": " + box + " along " + axis.name + " is outside of the grid, which goes from " + ends_of(axis),
        field);
  }
  const AxisRange range{first_centre_from(axis, low_mm), first_centre_from(axis, high_mm)};
  if (range.first < range.second) return range;
  throw Error(ErrorCode::kRegionEmpty,
              field + ": holds no voxel's centre along " + axis.name + " (" + box +
                  "); make it larger than the pitch, " + number_text(axis.pitch_mm) + " mm",
              field);
}

const Vec2& xy_of(const ContourPoint& point) { return point.xy; }
const Vec2& xy_of(const Vec2& point) { return point; }

template <typename Loop>
void drop_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<Loop>& loops) {
  const auto corner = [&](std::uint32_t column, std::uint32_t row) {
    return Vec2(lattice.x0_mm + column * lattice.dx_mm, lattice.y0_mm + row * lattice.dy_mm);
  };
  const Eigen::AlignedBox2d box(corner(window.first_column, window.first_row),
                                corner(window.end_column(), window.end_row()));
  std::erase_if(loops, [&](const Loop& loop) {
    Eigen::AlignedBox2d bounds;
    for (const auto& point : loop.points) bounds.extend(xy_of(point));
    return !bounds.intersects(box);
  });
}

}  // namespace

VoxelBox whole_region(const Grid& grid) { return {0, 0, 0, grid.extent}; }

VoxelBox region_of_box(const Grid& grid, const Box3& box_mm) {
  const std::array<RegionAxis, 3> axes = axes_of(grid);
  std::array<AxisRange, 3> ranges;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto i = static_cast<Eigen::Index>(a);
    ranges[a] = voxels_between(axes[a], box_mm.min()[i], box_mm.max()[i]);
  }
  const auto count = [&](std::size_t a) { return ranges[a].second - ranges[a].first; };
  return {ranges[0].first, ranges[1].first, ranges[2].first, {count(0), count(1), count(2)}};
}

void validate_region(const Grid& grid, const VoxelBox& region) {
  const std::array<std::uint32_t, 3> first = {region.first_column, region.first_row, region.first_layer};
  const std::array<std::uint32_t, 3> count = {region.extent.columns, region.extent.rows, region.extent.layers};
  const std::array<RegionAxis, 3> axes = axes_of(grid);
  for (std::size_t a = 0; a < 3; ++a) {
    if (count[a] == 0) {
      throw Error(ErrorCode::kRegionEmpty,
                  std::string(axes[a].count_field) + ": 0 or missing; a region has at least one voxel each way",
                  axes[a].count_field);
    }
    const std::uint64_t end = std::uint64_t{first[a]} + count[a];
    if (end <= axes[a].grid_count) continue;
    const char* field = first[a] >= axes[a].grid_count ? axes[a].first_field : axes[a].count_field;
    throw Error(ErrorCode::kRegionOutOfGrid,
                std::string(field) + ": the region's " + axes[a].voxels + " are " + std::to_string(first[a]) + " to " +
                    std::to_string(end - 1) + ", the grid has " + std::to_string(axes[a].grid_count) +
                    ", counted from 0; keep within them",
                field);
  }
}

void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<ContourLoop>& loops) {
  drop_outside(window, lattice, loops);
}

void drop_loops_outside(const LayerWindow& window, const LayerLattice& lattice, std::vector<RegionLoop>& loops) {
  drop_outside(window, lattice, loops);
}

}  // namespace ccslice
