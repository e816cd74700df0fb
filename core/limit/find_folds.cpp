// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr std::uint32_t kCancelPeriod = 64;
constexpr std::size_t kMaxReportedFolds = 32;
constexpr int kRegularDepth = 2;  // How often a regular cell's patch is halved, the last time only to look at middles.
constexpr int kIrregularDepth = 1;  // Each patch of an irregular cell.
constexpr int kLevels = 3;          // Levels of patches looked at towards an irregular place.

using Quad = Eigen::Vector4d;      // A point or vector, padded to one register.
using Net = std::array<Quad, 64>;  // Tricubic Bezier net.

struct Worst {
  double determinant = std::numeric_limits<double>::infinity();
  Vec3 position = Vec3::Zero();
};

constexpr std::size_t stride_of(int axis) { return std::size_t{1} << (2 * axis); }

/// Cubic Bernstein values and slopes at a parameter.
struct Basis {
  std::array<double, 4> value, slope;
};

constexpr Basis basis_at(double t) {
  const double r = 1 - t;
  return {{r * r * r, 3 * r * r * t, 3 * r * t * t, t * t * t},
          {-3 * r * r, 3 * r * (r - 2 * t), 3 * t * (2 * r - t), 3 * t * t}};
}

LimitSample evaluate(const Net& net, const Basis& u, const Basis& v, const Basis& w) {
  Quad position = Quad::Zero(), along_u = position, along_v = position, along_w = position;
  for (std::size_t k = 0; k < 4; ++k) {
    Quad plane = Quad::Zero(), plane_u = plane, plane_v = plane;
    for (std::size_t j = 0; j < 4; ++j) {
      const Quad* p = &net[4 * j + 16 * k];
      const Quad row = u.value[0] * p[0] + u.value[1] * p[1] + u.value[2] * p[2] + u.value[3] * p[3];
      plane_u += v.value[j] * (u.slope[0] * p[0] + u.slope[1] * p[1] + u.slope[2] * p[2] + u.slope[3] * p[3]);
      plane += v.value[j] * row;
      plane_v += v.slope[j] * row;
    }
    position += w.value[k] * plane;
    along_u += w.value[k] * plane_u;
    along_v += w.value[k] * plane_v;
    along_w += w.slope[k] * plane;
  }
  LimitSample sample;
  sample.position = position.head<3>();
  sample.jacobian << along_u.head<3>(), along_v.head<3>(), along_w.head<3>();
  return sample;
}

void keep_worse(const LimitSample& sample, Worst& worst) {
  const double determinant = sample.jacobian.determinant();
  if (determinant < worst.determinant) worst = {determinant, sample.position};
}

/// True if J = J0 (I + E) with ||E|| < 1 all over the net: then det J has the sign of det J0.
bool certainly_unfolded(const Net& net, const Mat3& jacobian) {
  const Mat3 inverse = jacobian.inverse();
  Eigen::Matrix<double, 4, 3> map = Eigen::Matrix<double, 4, 3>::Zero();
  map.topRows<3>() = 3 * inverse;
  Quad row_sums = Quad::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = stride_of(axis);
    const Quad unit = Quad::Unit(axis);
    Quad spread = Quad::Zero();
    for (std::size_t p = 0; p < 64; ++p) {
      if ((p / stride) % 4 == 3) continue;
      const Quad d = net[p + stride] - net[p];
      const Quad image = d[0] * map.col(0) + d[1] * map.col(1) + d[2] * map.col(2);
      spread = spread.cwiseMax((image - unit).cwiseAbs());
    }
    row_sums += spread;
  }
  return row_sums.maxCoeff() < 1;
}

void halve(const Net& net, int axis, Net& low, Net& high) {
  const std::size_t stride = stride_of(axis);
  for (std::size_t p = 0; p < 64; ++p) {
    if ((p / stride) % 4 != 0) continue;
    const std::size_t q = p + stride, r = q + stride, s = r + stride;
    const Quad pq = (net[p] + net[q]) / 2, qr = (net[q] + net[r]) / 2, rs = (net[r] + net[s]) / 2;
    const Quad pqr = (pq + qr) / 2, qrs = (qr + rs) / 2;
    low[p] = net[p], low[q] = pq, low[r] = pqr, low[s] = high[p] = (pqr + qrs) / 2;
    high[q] = qrs, high[r] = rs, high[s] = net[s];
  }
}

constexpr Basis kMiddle = basis_at(0.5);
constexpr std::array<Basis, 2> kQuarters = {basis_at(0.25), basis_at(0.75)};

/// Looks at the middle; if that doesn't settle it, at the middles of the eight parts, `depth` times.
void search(const Net& net, int depth, Worst& worst) {
  const LimitSample centre = evaluate(net, kMiddle, kMiddle, kMiddle);
  keep_worse(centre, worst);
  if (centre.jacobian.determinant() > 0 && certainly_unfolded(net, centre.jacobian)) return;
  if (depth == 1) {
    for (std::size_t i = 0; i < 8; ++i) {
      keep_worse(evaluate(net, kQuarters[i & 1], kQuarters[i >> 1 & 1], kQuarters[i >> 2]), worst);
    }
    return;
  }
  std::array<Net, 8> parts;
  parts[0] = net;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t count = std::size_t{1} << axis;
    for (std::size_t i = 0; i < count; ++i) {
      const Net whole = parts[i];
      halve(whole, axis, parts[i], parts[i + count]);
    }
  }
  for (const Net& part : parts) search(part, depth - 1, worst);
}

Worst worst_in(const LimitCell& cell, PatchBuilder& builder) {
  Worst worst;
  const int depth = cell.cell_class == CellClass::kRegular ? kRegularDepth : kIrregularDepth;
  const auto look = [&](const PatchPath& path, double* grid) {
    bspline_to_bezier(grid, 3, kPositionDimension);
    Net net;
    for (std::size_t p = 0; p < 64; ++p) net[p] = Quad(grid[4 * p], grid[4 * p + 1], grid[4 * p + 2], 0);
    // All frames are proper, so a patch's own Jacobian has the sign of the cell's; its size is that of its box.
    Worst found;
    search(net, depth, found);
    const int halvings = 3 * (path.level + (path.child != 0)) + 2 * (path.line_level + (path.line_child != 0));
    found.determinant = std::ldexp(found.determinant, halvings);
    if (found.determinant < worst.determinant) worst = found;
  };
  const int line_levels = cell.cell_class == CellClass::kLine ? kLevels : 1;
  builder.visit_patches(cell, kLevels, line_levels, look, [](const Box3&) {});
  return worst;
}

}  // namespace

void find_folds(const CancellationToken& cancel, LimitSolid::Data& data) {
  PatchBuilder builder(data, kPositionDimension);
  std::vector<Box3> boxes;
  for (std::uint32_t c = 0; c < data.cells.size(); ++c) {
    if (c % kCancelPeriod == 0) cancel.throw_if_cancelled();
    const Worst worst = worst_in(data.cells[c], builder);
    if (worst.determinant > 0) continue;
    data.folding_cells.push_back(c);
    boxes.push_back(data.cell_boxes.box(c));
    if (data.summary.folds.size() < kMaxReportedFolds) {
      data.summary.folds.push_back({c, data.cells[c].control_cell, worst.position, worst.determinant});
    }
  }
  data.fold_boxes = BoxTree(boxes);
  data.summary.folding_cells = data.folding_cells.size();
}

}  // namespace ccslice
