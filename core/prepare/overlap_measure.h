// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a cell has in common with cells away from it: those whose control cells share no vertex with its own.
//
// Along lines through the cell, three by three along each axis, places are looked for in the other cells. Where a line
// leaves the overlap through the other cell's boundary it is followed to first order. Of the three axes the one along
// which most lines leave the overlap counts, so thin overlaps are measured across.
//
// Private to core/limit.

#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/limit/cell_index.h"
#include "core/prepare/cell_probe.h"

namespace ccslice {

/// What a cell has in common with another one.
struct OverlapPartner {
  LimitCellId cell;
  Vec3 position;        // Of a place in both: where the boundary is deepest in the partner, if it is in it at all. mm.
  double depth_mm = 0;  // There.
  double volume_mm3 = 0;  // What none of the partners before has in common with the cell, too.
};

struct CellOverlap {
  std::vector<OverlapPartner> partners;  // By cell.
  std::vector<LimitCellId> neighbours;   // Cells that touch it and come near its partners, if it has any.

  /// Keeps the deeper place.
  void add(const OverlapPartner& partner);
};

/// One solid, one thread.
class OverlapMeasure {
 public:
  static constexpr std::size_t kMostCandidates = 48;

  /// REQUIRES: both outlive this.
  OverlapMeasure(const LimitSolid& solid, CellProbe& probe) : solid_(solid), index_(solid.index()), probe_(probe) {}

  CellOverlap examine(LimitCellId cell);
  /// Boxes of cells compared so far.
  std::uint64_t work() const noexcept { return work_; }

 private:
  /// A place of the cell.
  struct Place {
    Vec3 position;
    Mat3 jacobian;
    std::optional<PlaceInCell> in;  // The first candidate that holds it.
    LimitCellId holder;
  };
  struct AlongAxis {
    int ends = -1;  // Of the overlap, on lines.
    std::vector<std::pair<LimitCellId, double>> volumes_mm3;
  };

  void collect(LimitCellId cell);
  Place look(const CellParam& at, bool on_boundary, CellOverlap& found);
  AlongAxis measure(LimitCellId cell, int axis, CellOverlap& found);
  /// How far the line goes on in the overlap from a place in it, as a parameter of the cell.
  double reach(const Place& place, const Vec3& along) const;

  const LimitSolid& solid_;
  const CellIndex& index_;
  CellProbe& probe_;
  std::vector<LimitCellId> candidates_, touching_;
  std::uint64_t work_ = 0;
};

}  // namespace ccslice
