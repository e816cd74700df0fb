// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/limit_solid_for_algorithm1.h"

#include <array>

#include "core/limit/solid_data.h"

namespace ccslice::oracle {
namespace {

/// A cell's own corners among its points (core/subdivision/ring.h); a vertex cell's are all in its star.
std::array<std::uint32_t, 8> corner_points(const LimitSolid::Data& data, const LimitCell& cell) {
  std::array<std::uint32_t, 8> points{};
  const std::size_t layer = data.ring_count(cell) / 4;  // Of a line cell.
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t u = corner & 1, v = corner >> 1 & 1, w = corner >> 2;
    switch (cell.cell_class) {
      case CellClass::kRegular: points[corner] = data.ring(cell)[(1 + u) + 4 * (1 + v) + 16 * (1 + w)]; break;
      case CellClass::kLine: points[corner] = data.ring(cell)[(1 + w) * layer + u + 2 * v]; break;
      case CellClass::kVertex:
        points[corner] = data.star(cell)[data.operators.vertices()[cell.op].shared[corner]];
        break;
    }
  }
  return points;
}

}  // namespace

CellBoxes cell_boxes(const LimitSolid& solid) {
  const LimitSolid::Data& data = solid.data();
  CellBoxes boxes;
  for (const LimitCell& cell : data.cells) {
    Box3 all, own;
    data.for_each_point(cell, [&](std::size_t, std::uint32_t point) {
      if (point != kNone) all.extend(data.position(point));
    });
    for (const std::uint32_t point : corner_points(data, cell)) own.extend(data.position(point));
    boxes.rings.push_back(all);
    boxes.corners.push_back(own);
  }
  return boxes;
}

void LimitSolidForAlgorithm1::geo_and_jacobian(const CellParam& at, Vec3& position, Mat3& jacobian) {
  const LimitSample sample = evaluator_.sample(at);
  position = sample.position;
  jacobian = sample.jacobian;
}

}  // namespace ccslice::oracle
