// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr std::uint32_t kCancelPeriod = 256;
constexpr double kSmallestDeterminant = 1e-12;  // Of the Jacobian with unit columns.

/// Calls visit(point) for points whose hull holds the cell: the Bezier nets of the outermost patches, and what holds
/// the rest at the irregular place.
template <typename Visit>
void visit_hull(const LimitCell& cell, PatchBuilder& builder, Visit visit) {
  const auto add_patch = [&](const PatchPath&, double* grid) {
    bspline_to_bezier(grid, 3, kPositionDimension);
    for (std::size_t p = 0; p < 64; ++p) visit(Vec3::Map(grid + kPositionDimension * p).eval());
  };
  builder.visit_patches(cell, 1, 2, add_patch, [&](const PatchRest& rest) { rest.visit_hull(visit); });
}

/// What is known of the middles of cells, of all that control points hold.
class Middles {
 public:
  explicit Middles(LimitSolid::Data& data)
      : data_(data),
        builder_(data, data.dimension),
        grid_(64 * data.dimension),
        channels_(64 * (data.dimension - 3)),
        at_middle_(data.dimension - 3) {
    data.cell_maps.reserve(data.cells.size());
    data.middle_channels.reserve(data.cells.size() * at_middle_.size());
  }

  CellMap& append(const LimitCell& cell) {
    const PatchPlace place = find_patch(data_, cell, Vec3::Constant(0.5));
    builder_.build(cell, place.path, grid_.data());
    load_patch(grid_.data(), data_.dimension, points_.data(), channels_.data());
    patch_channels({points_.data(), channels_.data()}, place.local, at_middle_);
    data_.middle_channels.insert(data_.middle_channels.end(), at_middle_.begin(), at_middle_.end());
    const LimitSample sample = in_cell(place, patch_sample(points_.data(), place.local));
    CellMap& map = data_.cell_maps.emplace_back();
    map.middle = sample.position;
    if (std::abs(sample.jacobian.colwise().normalized().determinant()) > kSmallestDeterminant) {
      map.inverse_jacobian = sample.jacobian.inverse();
    }
    if (!map.inverse_jacobian.allFinite()) map.inverse_jacobian.setZero();
    return map;
  }

 private:
  LimitSolid::Data& data_;
  PatchBuilder builder_;
  std::vector<double> grid_;
  alignas(32) std::array<double, kPatchPoints> points_;
  std::vector<double> channels_, at_middle_;
};

}  // namespace

void build_cell_boxes(const CancellationToken& cancel, LimitSolid::Data& data) {
  PatchBuilder builder(data, kPositionDimension);
  std::vector<Box3> all;
  all.reserve(data.cells.size());
  Middles middles(data);
  for (const LimitCell& cell : data.cells) {
    if (all.size() % kCancelPeriod == 0) cancel.throw_if_cancelled();
    CellMap& map = middles.append(cell);
    Box3 box;
    visit_hull(cell, builder, [&](const Vec3& point) {
      box.extend(point);
      map.hull.extend(map(point));
    });
    all.push_back(box);
    CellVolumes& volumes = cell.cell_class == CellClass::kRegular ? data.regular_volumes : data.irregular_volumes;
    const double volume = data.volume_mm3(static_cast<std::uint32_t>(all.size() - 1));
    volumes = {std::min(volumes.least, volume), std::max(volumes.most, volume)};
  }
  data.cell_boxes = BoxTree(all, cancel);
}

}  // namespace ccslice
