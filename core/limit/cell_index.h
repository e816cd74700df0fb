// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where the limit-ready cells of a solid are: what finds the cells near a point or a box, and a first guess of a
// point's parameters in each.

#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/types.h"
#include "core/limit/box_tree.h"
#include "core/limit/cell_hulls.h"
#include "core/limit/cell_maps.h"

namespace ccslice {

/// About, by the Jacobians in the middle of cells; infinite where there is none. mm^3.
struct CellVolumes {
  double least = std::numeric_limits<double>::infinity(), most = 0;
};

struct CellIndex {
  CellMaps cell_maps;
  CellVolumes regular_volumes, irregular_volumes;
  FloatBoxTree cell_boxes;              // Bounding boxes of the cells' limits, mesh frame.
  BoxTree fold_boxes;                   // Boxes of the cells that fold, or may, and of overlaps of one part's cells.
  std::vector<LimitCellId> fold_cells;  // Those that fold, or may, ascending.
  CellHulls hulls_near_folds;           // Of the cells whose boxes meet those of fold_boxes; or none.
  BoxTree overlap_boxes;                // Boxes of the cells that may overlap a separate part of the solid.
  std::vector<std::uint32_t> parts;     // By cell: its part, numbered by first cells. Empty if no parts overlap.

  /// The solid may fold or overlap itself in this box, or separate parts of it may overlap there: a point may have
  /// several parameters.
  bool is_ambiguous(const Box3& box) const noexcept {
    const auto any = [](std::uint32_t) { return true; };
    return fold_boxes.any_meeting(box, any) || overlap_boxes.any_meeting(box, any);
  }
  double volume_mm3(LimitCellId cell) const { return 1 / std::abs(cell_maps[cell].inverse_jacobian.determinant()); }
};

}  // namespace ccslice
