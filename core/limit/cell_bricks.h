// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A BRICK is a box of 27 to 64 regular cells, up to 4 along each axis, whose patches are those of one uniform B-spline:
// its control points are listed once, and the limit of all its cells follows from them.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/types.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/ring.h"

namespace ccslice {

/// Its parameters run from 0 to the number of cells along each axis.
struct CellBrick {
  std::array<std::uint8_t, 3> cells = {1, 1, 1};  // Along each axis.
  PhantomMask phantoms = 0;                       // Outer layers of points that fill_phantoms() makes.
  std::uint8_t boundary_sides = 0;                // Bit 2 * axis + (at its end): faces of the boundary lie there.
  std::uint32_t first_cell = 0, first_point = 0;  // In CellBricks.

  std::size_t cell_count() const { return std::size_t{cells[0]} * cells[1] * cells[2]; }
  /// Along an axis there are three more points than cells.
  std::size_t points_along(std::size_t axis) const { return cells[axis] + std::size_t{3}; }
  std::size_t point_count() const { return points_along(0) * points_along(1) * points_along(2); }
};

class CellBricks {
 public:
  static constexpr std::size_t kMostCells = 4;  // Along an axis.

  struct Cell {
    LimitCellId cell;
    Frame frame;  // Framed parameters of the cell are those of the brick less the cell's place in it.
  };

  std::size_t size() const { return bricks_.size(); }
  const CellBrick& operator[](std::uint32_t brick) const { return bricks_[brick]; }
  /// The brick that a cell is in, or kNone.
  std::uint32_t brick_of(LimitCellId cell) const { return bricks_.empty() ? kNone : of_cell_[cell]; }
  /// The first axis fastest.
  std::span<const Cell> cells(const CellBrick& brick) const {
    return std::span(cells_).subspan(brick.first_cell, brick.cell_count());
  }
  /// Control points, the first axis fastest; kNone in phantom layers.
  std::span<const std::uint32_t> points(const CellBrick& brick) const {
    return std::span(points_).subspan(brick.first_point, brick.point_count());
  }
  /// The cell's parameter at one of the brick.
  [[nodiscard]] CellParam cell_param(const CellBrick& brick, const Vec3& at) const;
  std::size_t memory_bytes() const;

 private:
  friend class BrickFinder;

  std::vector<CellBrick> bricks_;
  std::vector<std::uint32_t> of_cell_;
  std::vector<Cell> cells_;
  std::vector<std::uint32_t> points_;
};

}  // namespace ccslice
