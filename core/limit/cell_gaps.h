// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells that touch each other, and yet have a GAP between them: they are on either side of a slit that ends in an edge
// or a vertex of both. What they hold goes on from one to the other there, and nowhere else.

#pragma once

#include <span>

#include "core/limit/limit_solid.h"

namespace ccslice {

/// In a regular mesh two cells that share but an edge go on from one another through one between them, and those that
/// share but a vertex through two. Where it takes more, and they share it on the boundary, there is a gap, or a mesh
/// that is far from regular. `around`: those that lie round what they share; where some are missing, a gap may be found
/// that isn't there.
/// REQUIRES: the two touch (LimitSolid::touch()).
bool is_across_a_gap(const LimitSolid& solid, LimitCellId here, LimitCellId there, std::span<const LimitCellId> around);

}  // namespace ccslice
