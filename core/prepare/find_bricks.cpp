// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/limit/cell_bricks.h"
#include "core/limit/solid_data.h"
#include "core/prepare/prepare.h"

namespace ccslice {

/// Cells are taken in their order. Each that is in no brick begins one, in its own frame, which grows by whole sides
/// while all cells beside one are there and go on from it. They do if their rings hold the same points: then their
/// patches are those of one B-spline, however the cells are numbered and turned.
class BrickFinder {
 public:
  BrickFinder(const LimitSolid::Data& data, CellBricks& bricks) : data_(data), bricks_(bricks) {}

  void run(const CancellationToken& cancel) {
    constexpr std::uint32_t kCellsPerPoll = 1024;
    bricks_.of_cell_.assign(data_.cells.size(), kNone);
    list_cells();
    for (std::uint32_t c = 0; c < data_.cells.size(); ++c) {
      if (c % kCellsPerPoll == 0) cancel.throw_if_cancelled();
      const LimitCellId cell{c};
      if (is_free(cell)) grow_from(cell);
    }
    if (bricks_.bricks_.empty()) bricks_ = {};
    bricks_.bricks_.shrink_to_fit();
    bricks_.cells_.shrink_to_fit();
    bricks_.points_.shrink_to_fit();
  }

 private:
  static constexpr std::size_t kReach = CellBricks::kMostCells - 1;  // Cells on either side of the first one.
  static constexpr std::size_t kCells = 2 * kReach + 1, kPoints = kCells + 3;
  static constexpr std::size_t kFewestCells = 27;       // Lists of points of smaller ones take more than they spare.
  static constexpr std::uint32_t kUnknown = kNone - 1;  // No point has this number.

  using Place = std::array<std::size_t, 3>;
  static std::size_t cell_at(const Place& p) { return p[0] + kCells * (p[1] + kCells * p[2]); }
  static std::size_t point_at(const Place& p) { return p[0] + kPoints * (p[1] + kPoints * p[2]); }

  bool is_free(LimitCellId cell) const {
    return data_.cells[cell].cell_class == CellClass::kRegular && bricks_.of_cell_[cell] == kNone;
  }
  std::uint32_t corner(LimitCellId cell, unsigned c) const {
    return data_.ring(data_.cells[cell])[(1 + (c & 1)) + 4 * (1 + (c >> 1 & 1)) + 16 * (1 + (c >> 2))];
  }

  /// Regular cells by their corner of the lowest number.
  void list_cells() {
    first_.assign(data_.points.size() / data_.dimension, kNone);
    next_.assign(data_.cells.size(), kNone);
    for (std::uint32_t c = static_cast<std::uint32_t>(data_.cells.size()); c-- > 0;) {
      if (data_.cells[LimitCellId{c}].cell_class != CellClass::kRegular) continue;
      std::uint32_t lowest = kNone;
      for (unsigned k = 0; k < 8; ++k) lowest = std::min(lowest, corner(LimitCellId{c}, k));
      next_[c] = std::exchange(first_[lowest], c);
    }
  }

  void grow_from(LimitCellId cell) {
    ids_.fill(kUnknown);
    low_ = {kReach, kReach, kReach};
    high_ = {kReach + 1, kReach + 1, kReach + 1};
    region_ = region_of(cell);
    added_.clear();
    put({kReach, kReach, kReach}, {cell, {}});
    for (std::size_t axis = 0; axis < 3; ++axis) {
      while (high_[axis] - low_[axis] < CellBricks::kMostCells && extend(axis, true)) ++high_[axis];
      while (high_[axis] - low_[axis] < CellBricks::kMostCells && extend(axis, false)) --low_[axis];
    }
    if (added_.size() >= kFewestCells) {
      keep();
    } else {
      forget_from(0);
    }
  }

  /// Cells that were added from the n-th on are free again.
  void forget_from(std::size_t n) {
    for (std::size_t i = n; i < added_.size(); ++i) bricks_.of_cell_[added_[i]] = kNone;
    added_.resize(n);
  }

  std::uint8_t region_of(LimitCellId cell) const {
    return data_.cell_regions.empty() ? std::uint8_t{0} : data_.cell_regions[data_.cells[cell].control_cell];
  }

  /// Adds all cells on one side. False, and nothing is added, if one of them isn't there or doesn't go on.
  bool extend(std::size_t axis, bool up) {
    const std::size_t before = added_.size();
    Place from = low_, end = high_;
    from[axis] = up ? high_[axis] : low_[axis] - 1;
    end[axis] = from[axis] + 1;
    bool all = true;
    for (std::size_t k = from[2]; k < end[2] && all; ++k) {
      for (std::size_t j = from[1]; j < end[1] && all; ++j) {
        for (std::size_t i = from[0]; i < end[0] && all; ++i) all = add({i, j, k});
      }
    }
    // Points that the side brought stay where they are: the brick doesn't grow on that side any more.
    if (!all) forget_from(before);
    return all;
  }

  /// Adds the cell whose corners are known to be at this place.
  bool add(const Place& place) {
    std::array<std::uint32_t, 8> corners;
    for (unsigned c = 0; c < 8; ++c) {
      corners[c] = ids_[point_at({place[0] + 1 + (c & 1), place[1] + 1 + (c >> 1 & 1), place[2] + 1 + (c >> 2)})];
    }
    const std::uint32_t lowest = *std::ranges::min_element(corners);
    if (lowest >= kUnknown) return false;
    for (std::uint32_t c = first_[lowest]; c != kNone; c = next_[c]) {
      const LimitCellId cell{c};
      Frame frame;
      if (is_free(cell) && find_frame(cell, corners, frame)) {
        return region_of(cell) == region_ && put(place, {cell, frame});
      }
    }
    return false;
  }

  bool find_frame(LimitCellId cell, const std::array<std::uint32_t, 8>& corners, Frame& frame) const {
    std::array<std::uint32_t, 8> own;
    for (unsigned c = 0; c < 8; ++c) own[c] = corner(cell, c);
    const auto number_of = [&](std::uint32_t id) {
      return static_cast<unsigned>(std::ranges::find(own, id) - own.begin());
    };
    const unsigned origin = number_of(corners[0]);
    if (origin == 8) return false;
    frame.origin = static_cast<std::uint8_t>(origin);
    for (unsigned a = 0; a < 3; ++a) {
      const unsigned step = number_of(corners[1u << a]) ^ origin;
      if (step != 1 && step != 2 && step != 4) return false;
      frame.axis[a] = static_cast<std::uint8_t>(step >> 1);
    }
    for (unsigned c = 0; c < 8; ++c) {
      if (own[frame.corner(c)] != corners[c]) return false;
    }
    return true;
  }

  /// Its ring has to hold what is known there, and tells the rest.
  bool put(const Place& place, const CellBricks::Cell& added) {
    const CellRing ring = data_.ring(data_.cells[added.cell]);
    std::array<std::array<std::size_t, 4>, 3> steps;  // In the ring, by axis of the brick.
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t i = 0; i < 4; ++i) {
        steps[a][i] = (added.frame.is_mirrored(a) ? 3 - i : i) << (2 * added.frame.axis[a]);
      }
    }
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t j = 0; j < 4; ++j) {
        for (std::size_t i = 0; i < 4; ++i) {
          std::uint32_t& known = ids_[point_at({place[0] + i, place[1] + j, place[2] + k})];
          const std::uint32_t id = ring[steps[0][i] + steps[1][j] + steps[2][k]];
          if (known != kUnknown && known != id) return false;
          known = id;
        }
      }
    }
    cells_[cell_at(place)] = added;
    bricks_.of_cell_[added.cell] = kUnknown;  // Until it is kept: a ring of few cells mustn't meet itself.
    added_.push_back(added.cell);
    return true;
  }

  void keep() {
    CellBrick brick;
    brick.first_cell = static_cast<std::uint32_t>(bricks_.cells_.size());
    brick.first_point = static_cast<std::uint32_t>(bricks_.points_.size());
    const auto number = static_cast<std::uint32_t>(bricks_.bricks_.size());
    for (std::size_t a = 0; a < 3; ++a) {
      brick.cells[a] = static_cast<std::uint8_t>(high_[a] - low_[a]);
      // The outer layers, in the middle of which no other axis' phantoms are.
      Place low = {low_[0] + 1, low_[1] + 1, low_[2] + 1}, high = low;
      low[a] = low_[a], high[a] = high_[a] + 2;
      if (ids_[point_at(low)] == kNone) brick.phantoms |= static_cast<PhantomMask>(1u << (2 * a));
      if (ids_[point_at(high)] == kNone) brick.phantoms |= static_cast<PhantomMask>(2u << (2 * a));
    }
    for (std::size_t k = low_[2]; k < high_[2]; ++k) {
      for (std::size_t j = low_[1]; j < high_[1]; ++j) {
        for (std::size_t i = low_[0]; i < high_[0]; ++i) {
          const CellBricks::Cell& cell = cells_[cell_at({i, j, k})];
          bricks_.cells_.push_back(cell);
          bricks_.of_cell_[cell.cell] = number;
          brick.boundary_sides |= boundary_sides_of(cell, {i, j, k});
        }
      }
    }
    for (std::size_t k = low_[2]; k < high_[2] + 3; ++k) {
      for (std::size_t j = low_[1]; j < high_[1] + 3; ++j) {
        for (std::size_t i = low_[0]; i < high_[0] + 3; ++i) bricks_.points_.push_back(ids_[point_at({i, j, k})]);
      }
    }
    bricks_.bricks_.push_back(brick);
  }

  /// Those of the cell that are the brick's.
  std::uint8_t boundary_sides_of(const CellBricks::Cell& cell, const Place& place) const {
    unsigned sides = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const unsigned low_side = 2u * cell.frame.axis[a] + (cell.frame.is_mirrored(a) ? 1u : 0u);
      const unsigned own = data_.cells[cell.cell].boundary_sides;
      if (place[a] == low_[a] && own >> low_side & 1) sides |= 1u << (2 * a);
      if (place[a] + 1 == high_[a] && own >> (low_side ^ 1u) & 1) sides |= 2u << (2 * a);
    }
    return static_cast<std::uint8_t>(sides);
  }

  const LimitSolid::Data& data_;
  CellBricks& bricks_;
  std::vector<std::uint32_t> first_, next_;  // By lowest corner; by cell.
  // The brick at hand, around the cell that begins it: cells from low_ on, up to high_.
  Place low_, high_;
  std::uint8_t region_ = 0;
  std::vector<LimitCellId> added_;
  std::array<CellBricks::Cell, kCells * kCells * kCells> cells_;
  std::array<std::uint32_t, kPoints * kPoints * kPoints> ids_;
};

void find_bricks(const PrepareOptions& options, LimitSolid::Data& data) {
  if (data.summary.deviation.as_meshed || data.summary.regular_cells == 0) return;
  BrickFinder(data, data.bricks).run(options.cancel);
}

}  // namespace ccslice
