// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// HANGING NODES: where small cells lie on a large one, as adaptive refinement makes them, a vertex of theirs lies in
// the middle of its edge. Cells hang together by common faces only, so there they don't. The same is so where two
// triangles lie on a quadrilateral.

#pragma once

#include <cstddef>

#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

struct HangingNodes {
  std::size_t edges = 0;           // With a vertex near their middle, which edges of other cells join to both ends.
  std::size_t quadrilaterals = 0;  // With two triangles on their corners.
  Vec3 first = Vec3::Zero();       // The middle of the first one, mm.

  bool any() const { return edges + quadrilaterals > 0; }
};

/// Looks at the boundary of the mesh, whose complex it is. Vertices within `same_mm` of each other are one.
HangingNodes find_hanging_nodes(const ControlMesh& mesh, const CellComplex& complex, double same_mm);

}  // namespace ccslice
