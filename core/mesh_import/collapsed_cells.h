// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// COLLAPSED CELLS. LS-DYNA, ANSYS, Radioss and others write wedges, tetrahedra and pyramids as hexahedra that name a
// node more than once, such as 0 1 2 2 3 4 5 5, and tetrahedra as wedges. What such a cell is follows from the faces
// that are left of it: repeated corners become one, and what has fewer than three goes.
//
// PYRAMIDS never refine to hexahedra, but two tetrahedra do. A quadrilateral that is on the boundary may be halved
// along either diagonal (the shorter one is taken), and one between two pyramids too, if both are halved along the
// same. Where tetrahedra or wedges have triangles over three of its corners, these say which diagonal it is. Beyond a
// hexahedron's or a wedge's quadrilateral nothing can be halved: such a pyramid is refused. Readers hand pyramids on as
// hexahedra whose corners 4 to 7 are the apex.
//
// LS-DYNA's tetrahedron n1 n2 n3 n4 n4 n4 n4 n4 keeps a quadrilateral of all its four nodes. It is the tetrahedron that
// is meant, whose neighbours have triangles there.

#pragma once

#include <cstdint>

#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// What pyramids have of their own before the apex comes three times more.
inline constexpr std::uint64_t kPyramidCorners = 5;

/// Puts what they are in place of collapsed cells: where a pyramid becomes two tetrahedra, the cells behind it get
/// other ids, and cell numbers, sets, materials, the file's numbers and mid-nodes go along. Cells that are nothing
/// known stay as they are, for validate() to refuse. Notes say how many there were. Throws Error{kMeshUnsupportedCell}
/// that names pyramids and the cells beyond their quadrilaterals, in the file's numbers, and says where. REQUIRES: the
/// cells' vertices exist; second_order is empty.
void resolve_collapsed_cells(MeshFile& file);

}  // namespace ccslice
