// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr std::uint32_t kCancelPeriod = 64;
constexpr std::size_t kMaxReportedFolds = 32;
constexpr int kRegularDepth = 2;   // Halvings of a regular cell's patch.
constexpr int kIrregularDepth = 1; // Of each patch of an irregular cell.
constexpr std::uint8_t kLevels = 2;  // Levels of patches looked at towards an irregular place.

using Net = std::array<Vec3, 64>;  // Tricubic Bezier net.

struct Worst {
  double determinant = std::numeric_limits<double>::infinity();
  Vec3 position = Vec3::Zero();
};

constexpr std::size_t stride_of(int axis) { return std::size_t{1} << (2 * axis); }

/// Position and Jacobian at the middle of a Bezier net: weights (1,3,3,1)/8, derivative weights (-1,-1,1,1) * 3/4.
LimitSample middle(const Net& net) {
  constexpr std::array<double, 4> value = {0.125, 0.375, 0.375, 0.125}, slope = {-0.75, -0.75, 0.75, 0.75};
  LimitSample sample;
  for (std::size_t p = 0; p < 64; ++p) {
    const std::size_t i = p & 3, j = p >> 2 & 3, k = p >> 4;
    sample.position += value[i] * value[j] * value[k] * net[p];
    sample.jacobian.col(0) += slope[i] * value[j] * value[k] * net[p];
    sample.jacobian.col(1) += value[i] * slope[j] * value[k] * net[p];
    sample.jacobian.col(2) += value[i] * value[j] * slope[k] * net[p];
  }
  return sample;
}

/// True if J = J0 (I + E) with ||E|| < 1 all over the net: then det J has the sign of det J0.
bool certainly_unfolded(const Net& net, const Mat3& jacobian) {
  const Mat3 inverse = jacobian.inverse();
  Vec3 row_sums = Vec3::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = stride_of(axis);
    Vec3 spread = Vec3::Zero();
    for (std::size_t p = 0; p < 64; ++p) {
      if ((p / stride) % 4 == 3) continue;
      const Vec3 derivative = 3 * (net[p + stride] - net[p]);
      spread = spread.cwiseMax((inverse * derivative - Vec3::Unit(axis)).cwiseAbs());
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
    const Vec3 pq = (net[p] + net[q]) / 2, qr = (net[q] + net[r]) / 2, rs = (net[r] + net[s]) / 2;
    const Vec3 pqr = (pq + qr) / 2, qrs = (qr + rs) / 2;
    low[p] = net[p], low[q] = pq, low[r] = pqr, low[s] = high[p] = (pqr + qrs) / 2;
    high[q] = qrs, high[r] = rs, high[s] = net[s];
  }
}

void search(const Net& net, int depth, Worst& worst) {
  const LimitSample centre = middle(net);
  const double determinant = centre.jacobian.determinant();
  if (determinant < worst.determinant) worst = {determinant, centre.position};
  if (depth == 0 || (determinant > 0 && certainly_unfolded(net, centre.jacobian))) return;
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

class FoldFinder {
 public:
  explicit FoldFinder(const LimitSolid::Data& data) : data_(data), builder_(data), grid_(64 * data.dimension) {}

  Worst worst(const LimitCell& cell) {
    worst_ = {};
    if (cell.cell_class == CellClass::kRegular) {
      look(cell, {}, kRegularDepth);
    } else if (cell.cell_class == CellClass::kLine) {
      look_at_line(cell, {});
    } else {
      std::uint32_t op = cell.op;
      for (std::uint8_t level = 0; level < kLevels; ++level) {
        const VertexOperator& now = data_.operators.vertices()[op];
        for (std::uint8_t child = 1; child < 8; ++child) {
          const PatchPath path{level, child, 0, 0};
          now.children[child].cell_class == CellClass::kLine ? look_at_line(cell, path)
                                                             : look(cell, path, kIrregularDepth);
        }
        op = now.children[0].op;
      }
    }
    return worst_;
  }

 private:
  void look(const LimitCell& cell, const PatchPath& path, int depth) {
    builder_.build(cell, path, grid_.data());
    bspline_to_bezier(grid_.data(), 3, data_.dimension);
    Net net;
    for (std::size_t p = 0; p < 64; ++p) net[p] = Vec3::Map(grid_.data() + p * data_.dimension);
    // All frames are proper, so a patch's own Jacobian has the sign of the cell's; its size is that of its box.
    Worst found;
    search(net, depth, found);
    const double levels = path.level + (path.child != 0), line_levels = path.line_level + (path.line_child != 0);
    found.determinant *= std::exp2(3 * levels + 2 * line_levels);
    if (found.determinant < worst_.determinant) worst_ = found;
  }

  void look_at_line(const LimitCell& cell, PatchPath path) {
    const int levels = cell.cell_class == CellClass::kLine ? kLevels : 1;
    for (path.line_level = 0; path.line_level < levels; ++path.line_level) {
      for (path.line_child = 1; path.line_child < 4; ++path.line_child) look(cell, path, kIrregularDepth);
    }
  }

  const LimitSolid::Data& data_;
  PatchBuilder builder_;
  std::vector<double> grid_;
  Worst worst_;
};

}  // namespace

void find_folds(const CancellationToken& cancel, LimitSolid::Data& data) {
  FoldFinder finder(data);
  std::vector<Box3> boxes;
  for (std::uint32_t c = 0; c < data.cells.size(); ++c) {
    if (c % kCancelPeriod == 0) cancel.throw_if_cancelled();
    const Worst worst = finder.worst(data.cells[c]);
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
