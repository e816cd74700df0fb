// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_bricks.h"

#include <algorithm>
#include <cmath>

namespace ccslice {

CellParam CellBricks::cell_param(const CellBrick& brick, const Vec3& at) const {
  std::size_t place = 0;
  Vec3 within;
  for (std::size_t a = 3; a-- > 0;) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double cell = std::clamp(std::floor(at[axis]), 0.0, brick.cells[a] - 1.0);
    place = place * brick.cells[a] + static_cast<std::size_t>(cell);
    within[axis] = std::clamp(at[axis] - cell, 0.0, 1.0);
  }
  const Cell& found = cells(brick)[place];
  return {found.cell, found.frame.from_framed(within)};
}

std::size_t CellBricks::memory_bytes() const {
  return bricks_.capacity() * sizeof(CellBrick) + of_cell_.capacity() * sizeof(std::uint32_t) +
         cells_.capacity() * sizeof(Cell) + points_.capacity() * sizeof(std::uint32_t);
}

}  // namespace ccslice
