// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/support/limit_solid_for_algorithm1.h"

#include <array>

#include "core/limit/solid_data.h"

namespace ccslice::oracle {
namespace {

/// Where a cell's own corners stand in its ring (core/subdivision/ring.h).
std::array<std::size_t, 8> corners_in_ring(const LimitCell& cell) {
  std::array<std::size_t, 8> places{};
  const std::size_t layer = cell.ring_count / 4;  // Of a line cell.
  for (std::size_t corner = 0; corner < 8; ++corner) {
    const std::size_t u = corner & 1, v = corner >> 1 & 1, w = corner >> 2;
    switch (cell.cell_class) {
      case CellClass::kRegular: places[corner] = (1 + u) + 4 * (1 + v) + 16 * (1 + w); break;
      case CellClass::kLine: places[corner] = (1 + w) * layer + u + 2 * v; break;
      case CellClass::kVertex: places[corner] = corner; break;
    }
  }
  return places;
}

}  // namespace

CellBoxes cell_boxes(const LimitSolid& solid) {
  const LimitSolid::Data& data = solid.data();
  CellBoxes boxes;
  for (const LimitCell& cell : data.cells) {
    const std::span<const std::uint32_t> ring = data.ring(cell);
    Box3 all, own;
    for (const std::uint32_t point : ring) {
      if (point != kNone) all.extend(data.position(point));
    }
    for (const std::size_t place : corners_in_ring(cell)) own.extend(data.position(ring[place]));
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
