// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/limit_volume.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>

#include "core/prepare/id_ranges.h"

namespace ccslice {

namespace {

constexpr std::size_t kNodes = 5;

/// The Gauss points along s, side by side; those without a weight fill the registers.
using Nodes = Eigen::Array<double, 8, 1>;

/// The cubic Bernstein polynomials and their derivatives at the Gauss points of [0,1].
struct GaussTable {
  Nodes weight = Nodes::Zero();
  std::array<Nodes, 4> value, slope;  // By polynomial.
};

GaussTable make_gauss_table() {
  const double inner = std::sqrt(5 - 2 * std::sqrt(10.0 / 7)) / 3, outer = std::sqrt(5 + 2 * std::sqrt(10.0 / 7)) / 3;
  const double inner_weight = (322 + 13 * std::sqrt(70.0)) / 1800, outer_weight = (322 - 13 * std::sqrt(70.0)) / 1800;
  Nodes x = Nodes::Zero();
  x.head<kNodes>() << (1 - outer) / 2, (1 - inner) / 2, 0.5, (1 + inner) / 2, (1 + outer) / 2;
  const Nodes y = 1 - x;
  GaussTable table;
  table.weight.head<kNodes>() << outer_weight, inner_weight, 64.0 / 225, inner_weight, outer_weight;
  table.value = {y * y * y, 3 * y * y * x, 3 * y * x * x, x * x * x};
  table.slope = {-3 * y * y, 3 * y * (y - 2 * x), 3 * x * (2 * y - x), 3 * x * x};
  return table;
}

const GaussTable& gauss() {
  static const GaussTable kTable = make_gauss_table();
  return kTable;
}

/// The curve over four control points `stride` apart, or its derivative, at the Gauss points: one coordinate, from
/// `zero` on.
Nodes along_curve(const std::array<Nodes, 4>& basis, const PaddedPoint* points, std::size_t stride, int axis,
                  double zero = 0) {
  return basis[0] * (points[0][axis] - zero) + basis[1] * (points[stride][axis] - zero) +
         basis[2] * (points[2 * stride][axis] - zero) + basis[3] * (points[3 * stride][axis] - zero);
}

/// What four rows come to at Gauss point j along t.
Nodes across_rows(const std::array<Nodes, 4>& basis, Eigen::Index j, const std::array<Nodes, 4>& rows) {
  return basis[0][j] * rows[0] + basis[1][j] * rows[1] + basis[2][j] * rows[2] + basis[3][j] * rows[3];
}

/// The integral of (z - floor) dx dy over the patch.
double flux(const BezierPatch& patch, double floor) {
  const GaussTable& table = gauss();
  std::array<Nodes, 4> x, y, z, slope_x, slope_y;  // By row; slopes along s.
  for (std::size_t row = 0; row < 4; ++row) {
    const PaddedPoint* points = &patch.b[4 * row];
    x[row] = along_curve(table.value, points, 1, 0);
    y[row] = along_curve(table.value, points, 1, 1);
    z[row] = along_curve(table.value, points, 1, 2, floor);
    slope_x[row] = along_curve(table.slope, points, 1, 0);
    slope_y[row] = along_curve(table.slope, points, 1, 1);
  }
  Nodes sum = Nodes::Zero();
  for (Eigen::Index j = 0; j < static_cast<Eigen::Index>(kNodes); ++j) {
    const Nodes area = across_rows(table.value, j, slope_x) * across_rows(table.slope, j, y) -
                       across_rows(table.value, j, slope_y) * across_rows(table.slope, j, x);
    sum += table.weight[j] * across_rows(table.value, j, z) * area;
  }
  return (table.weight * sum).sum();
}

/// The integral of (z - floor) dx dy over the cone from `apex` to a cubic Bezier curve, the curve running
/// counter-clockwise.
double cone_flux(const PaddedPoint* curve, std::size_t stride, const Vec3& apex, double floor) {
  const GaussTable& table = gauss();
  const Nodes x = along_curve(table.value, curve, stride, 0, apex.x());
  const Nodes y = along_curve(table.value, curve, stride, 1, apex.y());
  const Nodes z = along_curve(table.value, curve, stride, 2, apex.z());
  const Nodes twice_area =
      x * along_curve(table.slope, curve, stride, 1) - y * along_curve(table.slope, curve, stride, 0);
  return (table.weight * (z / 3 + (apex.z() - floor) / 2) * twice_area).sum();
}

/// The integral over an irregular face, with a cone instead of what remains after `levels` levels.
double irregular_flux(const BoundarySurface& surface, BoundaryFaceId face, int levels, double floor,
                      IrregularCorner& corner) {
  std::array<BezierPatch, 3> patches;
  surface.irregular_corner(face, corner);
  const Vec3 apex = surface.corner_position(corner);
  double sum = 0;
  for (int level = 0; level < levels; ++level) {
    surface.split(corner, patches);
    for (const BezierPatch& patch : patches) sum += flux(patch, floor);
  }
  // What remains has two outer sides: s = 0 of the patch beside it, upwards, and t = 0 of that above, backwards.
  return sum + cone_flux(&patches[0].b[0], 4, apex, floor) - cone_flux(&patches[1].b[0], 1, apex, floor);
}

}  // namespace

std::vector<double> face_fluxes_mm3(const BoundarySurface& surface, std::span<const BoundaryFace> faces, int levels,
                                    int threads, const CancellationToken& cancel) {
  std::vector<double> fluxes(faces.size());
  if (faces.empty()) return fluxes;
  const double floor = surface.hull_box(BoundaryFaceId{0}).center().z();
  const auto make_corner = [] { return IrregularCorner(); };
  const IdRange<BoundaryFaceId> all(faces.size());
  for_each_range(all, threads, ids_per_range_of(all.size()), make_corner,
                 [&](IrregularCorner& corner, const auto& range) {
                   cancel.throw_if_cancelled();
                   for (const BoundaryFaceId face : range.ids) {
                     fluxes[face] = faces[face].regular ? flux(surface.regular_patch(face), floor)
                                                        : irregular_flux(surface, face, levels, floor, corner);
                   }
                 });
  return fluxes;
}

double limit_volume_mm3(const BoundarySurface& surface, int levels, int threads, const CancellationToken& cancel) {
  const std::vector<double> fluxes = face_fluxes_mm3(surface, surface.faces(), levels, threads, cancel);
  return std::accumulate(fluxes.begin(), fluxes.end(), 0.0);
}

}  // namespace ccslice
