// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Makes operators of rings, each from its ring alone, so several threads may. Which others an operator leads to is told
// by their rings: numbers are given by a table (operator_table.h), one after the other.

#pragma once

#include <array>
#include <functional>

#include "core/subdivision/key_hash.h"
#include "core/subdivision/operators.h"
#include "core/subdivision/ring.h"
#include "core/subdivision/surface_ring.h"

namespace ccslice {

/// children[0] has no operator yet: that of `next`. The limit is empty, unless both have the same ring.
template <typename Ring>
struct MadePlanar {
  PlanarOperator op;
  Ring next;
};
using MadeLine = MadePlanar<LineRing>;
using MadeSurface = MadePlanar<SurfaceRing>;

/// No child has its operator yet.
struct MadeCorner {
  CornerOperator op;
  VertexRing next;                // Of children[0],
  NumberedCells next_cells;       // and all cells round it, if they were asked for.
  std::array<LineRing, 8> lines;  // Of children that are line cells.
};

MadeLine make_line_operator(const LineRing& ring);
MadeSurface make_surface_operator(const SurfaceRing& ring);
StarOperator make_star_operator(const VertexStar& star);
/// `cells`: the neighbourhood from which the ring was walked (RingWalker::neighbourhood). Where wants(key of the next
/// ring), its cells are told as well.
MadeCorner make_corner_operator(const VertexRing& ring, const NumberedCells& cells,
                                const std::function<bool(const NumberKey&)>& wants);

/// The limit row at the irregular corner of an operator whose child there goes on with another one.
std::vector<double> limit_through(const std::vector<double>& limit_of_next, const PlanarOperator& op);

}  // namespace ccslice
