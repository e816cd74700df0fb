// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells that touch each other, and yet have a GAP between them: they are on either side of a slit that ends in an edge
// or a vertex of both. What they hold goes on from one to the other there, and nowhere else.

#pragma once

#include <span>

#include "core/base/types.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// In a regular mesh two cells that share but an edge go on from one another through one between them, and those that
/// share but a vertex through two. Where it takes more, and they share it on the boundary, there is a gap, or a mesh
/// that is far from regular. Where each of them has a face of the boundary at the edge that they share, and they are
/// face to face, there is one however few lie round its end. `around`: those that lie round what they share; where some
/// are missing, a gap may be found that isn't there.
/// REQUIRES: the two touch (LimitSolid::touch()).
bool is_across_a_gap(const LimitSolid& solid, LimitCellId here, LimitCellId there, std::span<const LimitCellId> around);

/// The cell has a face of the boundary that looks against that direction, by 60 degrees or less: from a face that looks
/// there a gap may lie between.
bool looks_back(const LimitSolid& solid, LimitCellId cell, const Vec3& direction);

}  // namespace ccslice
