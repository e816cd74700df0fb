// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/limit/id_ranges.h"
#include "core/limit/lane_box.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr double kSmallestDeterminant = 1e-12;  // Determinant of the Jacobian with unit columns.

/// Calls visit(point) for padded points whose hull holds the cell. They are the Bezier nets of the outermost patches,
/// and points whose hull holds the rest at the irregular place.
template <typename Visit>
void visit_hull(const LimitCell& cell, PatchBuilder& builder, Visit visit) {
  const auto add_patch = [&](const PatchPath&, double* grid) {
    bspline_to_bezier(grid, 3, kPositionDimension);
    for (std::size_t p = 0; p < 64; ++p) visit(load_unaligned(grid + kPositionDimension * p));
  };
  builder.visit_patches(cell, 1, 2, add_patch, [&](const PatchRest& rest) { rest.visit_hull(visit); });
}

CellMap cell_map(const LimitSolid::Data& data, const LimitCell& cell, PatchBuilder& builder) {
  alignas(32) std::array<double, kPatchPoints> grid;
  const PatchPlace place = find_patch(data, cell, Vec3::Constant(0.5));
  builder.build(cell, place.path, grid.data());
  const LimitSample sample = in_cell(place, patch_sample(grid.data(), place.local));
  CellMap map;
  map.middle = sample.position;
  if (std::abs(sample.jacobian.colwise().normalized().determinant()) > kSmallestDeterminant) {
    map.inverse_jacobian = sample.jacobian.inverse();
  }
  if (!map.inverse_jacobian.allFinite()) map.inverse_jacobian.setZero();
  return map;
}

}  // namespace

void build_cell_boxes(const PrepareOptions& options, LimitSolid::Data& data) {
  const auto count = static_cast<std::uint32_t>(data.cells.size());
  std::vector<Box3> boxes(count);
  data.cell_maps.resize(count);
  const auto make_builder = [&] { return PatchBuilder(data, kPositionDimension); };
  options.begin(PreparationStep::kBounding, count);
  const IdRange<LimitCellId> all(count);
  for_each_range(all, options.threads, make_builder, [&](PatchBuilder& builder, const auto& range) {
    options.cancel.throw_if_cancelled();
    for (const LimitCellId c : range.ids) {
      CellMap& map = data.cell_maps[c];
      map = cell_map(data, data.cells[c], builder);
      const LaneMap inverse_jacobian(map.inverse_jacobian);
      const Lanes middle = to_lanes(map.middle);
      LaneBox box, hull;
      visit_hull(data.cells[c], builder, [&](Lanes point) {
        box.extend(point);
        hull.extend(0.5 + inverse_jacobian(point - middle));
      });
      boxes[c] = box.box();
      map.hull = hull.box();
    }
    options.count(range.ids.size());
  });
  for (const LimitCellId c : IdRange<LimitCellId>(count)) {
    const bool is_regular = data.cells[c].cell_class == CellClass::kRegular;
    CellVolumes& volumes = is_regular ? data.regular_volumes : data.irregular_volumes;
    const double volume = data.volume_mm3(c);
    volumes = {std::min(volumes.least, volume), std::max(volumes.most, volume)};
  }
  data.cell_boxes = BoxTree(boxes, options.cancel);
}

}  // namespace ccslice
