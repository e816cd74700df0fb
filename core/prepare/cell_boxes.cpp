// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/limit/lane_box.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/prepare/id_ranges.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

namespace {

constexpr double kSmallestDeterminant = 1e-12;  // Determinant of the Jacobian with unit columns.

/// `grid`: the points of the patch at the cell's middle.
void set_map(LimitCellId cell, const PatchPlace& middle, const double* grid, CellMaps& maps) {
  alignas(32) std::array<double, kPatchPoints> points;
  std::copy_n(grid, kPatchPoints, points.data());
  const LimitSample sample = in_cell(middle, patch_sample(points.data(), middle.local));
  const bool is_regular = std::abs(sample.jacobian.colwise().normalized().determinant()) > kSmallestDeterminant;
  maps.set(cell, sample.position, is_regular ? sample.jacobian.inverse().eval() : Mat3::Zero());
}

/// One solid, one thread.
class CellBounds {
 public:
  explicit CellBounds(const LimitSolid::Data& data) : data_(data), builder_(data, kPositionDimension) {}

  /// The cell's box. Sets its map.
  Box3 bound(LimitCellId id, CellMaps& maps) {
    const LimitCell& cell = data_.cells[id];
    const PatchPlace middle = find_patch(data_, cell, Vec3::Constant(0.5));
    hull_.clear();
    const auto add_patch = [&](const PatchPath& path, double* grid) {
      if (path.packed() == middle.path.packed()) set_map(id, middle, grid, maps);
      bspline_to_bezier(grid, 3, kPositionDimension);
      hull_.insert(hull_.end(), grid, grid + kPatchPoints);
    };
    builder_.visit_patches(cell, 1, 2, add_patch, [&](const PatchRest& rest) {
      hull_.insert(hull_.end(), rest.points.begin(), rest.points.end());
    });
    const CellMap map = maps[id];
    const LaneMap inverse_jacobian(map.inverse_jacobian);
    const Lanes origin = to_lanes(map.middle);
    LaneBox box, guesses;
    for (std::size_t i = 0; i < hull_.size(); i += kPositionDimension) {
      const Lanes point = load_unaligned(&hull_[i]);
      box.extend(point);
      guesses.extend(0.5 + inverse_jacobian(point - origin));
    }
    maps.set_hull(id, guesses.box());
    return box.box();
  }

 private:
  const LimitSolid::Data& data_;
  PatchBuilder builder_;
  /// Points, padded, whose hull holds the cell: the Bezier nets of the outermost patches, and points whose hull holds
  /// the rest at the irregular place.
  std::vector<double> hull_;
};

}  // namespace

void build_cell_boxes(const PrepareOptions& options, LimitSolid::Data& data) {
  const auto count = static_cast<std::uint32_t>(data.cells.size());
  std::vector<Box3> boxes(count);
  Box3 points;
  for (std::uint32_t p = 0; p < data.points.size() / data.dimension; ++p) points.extend(data.position(p));
  data.cell_maps.resize(count, points.center());
  const auto make_bounds = [&] { return CellBounds(data); };
  options.begin(PreparationStep::kBounding, count);
  const IdRange<LimitCellId> all(count);
  for_each_range(all, options.threads, ids_per_range_of(count), make_bounds,
                 [&](CellBounds& bounds, const auto& range) {
                   options.cancel.throw_if_cancelled();
                   for (const LimitCellId c : range.ids) boxes[c] = bounds.bound(c, data.cell_maps);
                   options.count(range.ids.size());
                 });
  for (const LimitCellId c : IdRange<LimitCellId>(count)) {
    const bool is_regular = data.cells[c].cell_class == CellClass::kRegular;
    CellVolumes& volumes = is_regular ? data.regular_volumes : data.irregular_volumes;
    const double volume = data.volume_mm3(c);
    volumes = {std::min(volumes.least, volume), std::max(volumes.most, volume)};
  }
  data.cell_boxes = FloatBoxTree(boxes, options.cancel);
}

}  // namespace ccslice
