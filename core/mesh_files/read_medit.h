// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// MEDIT .mesh, ASCII: keyword, count, then as many entries. Ids count from 1 and every entry ends with a reference
// number, which has no meaning here. Read: Vertices, Hexahedra, Tetrahedra, Prisms (wedges), Pyramids, in any order,
// and those of second order and higher but for pyramids (medit_high_order.h). Passed over and reported: everything
// else. Refused: other cells of volume, two dimensions.

#pragma once

#include <string_view>

#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

/// Throws Error{kFileSyntax, kFileUnsupported, kMeshNonFinite, kMeshTooLarge, kMeshUnsupportedCell,
/// kMeshIndexOutOfRange}; messages name the line and the token, or the cells.
MeshFile read_medit(std::string_view text, const MeshLimits& limits = {});

}  // namespace ccslice
