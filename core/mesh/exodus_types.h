// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element types of Exodus files [SEACAS, exodus-element-types.md]. A name may end in the number of nodes, in upper
// or lower case. The corners come first, in VTK's order.

#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/mesh/cell_kind.h"

namespace ccslice {

enum class ExodusRole : std::uint8_t { kCell, kFlat, kPyramid, kUnknown };

struct ExodusElementType {
  std::string_view prefix;  // The first one that fits counts.
  ExodusRole role;
  CellKind kind = CellKind::kHex;
};

inline constexpr std::array kExodusElementTypes = {
    ExodusElementType{"HEXSHELL", ExodusRole::kUnknown},
    ExodusElementType{"HEX", ExodusRole::kCell, CellKind::kHex},
    ExodusElementType{"TET", ExodusRole::kCell, CellKind::kTet},
    ExodusElementType{"WEDGE", ExodusRole::kCell, CellKind::kWedge},
    ExodusElementType{"PYRAMID", ExodusRole::kPyramid},
    ExodusElementType{"SHELL", ExodusRole::kFlat},
    ExodusElementType{"TSHELL", ExodusRole::kFlat},
    ExodusElementType{"QUAD", ExodusRole::kFlat},
    ExodusElementType{"TRI", ExodusRole::kFlat},
    ExodusElementType{"BAR", ExodusRole::kFlat},
    ExodusElementType{"BEAM", ExodusRole::kFlat},
    ExodusElementType{"TRUSS", ExodusRole::kFlat},
    ExodusElementType{"ROD", ExodusRole::kFlat},
    ExodusElementType{"EDGE", ExodusRole::kFlat},
    ExodusElementType{"CIRCLE", ExodusRole::kFlat},
    ExodusElementType{"SPHERE", ExodusRole::kFlat},
};

}  // namespace ccslice
