// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The cells of a VTK file, as read, turned into those of a control mesh.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "core/mesh/text_scanner.h"

namespace ccslice {

struct VtkCells {
  std::vector<std::uint64_t> offsets;              // n + 1 positions in `connectivity`, ascending from 0.
  std::vector<std::uint32_t> connectivity;         // Point ids.
  std::vector<std::uint16_t> types;                // n VTK cell types.
  std::vector<std::uint64_t> places, type_places;  // n marks of the scanner each.
};

/// Appends the volume cells to `mesh` and a sentence on what was left out to `warnings`. Returns their numbers among
/// `cells`. Throws Error{kMeshUnsupportedCell, kFileSyntax}, which name the place by `scanner`. REQUIRES: one offset
/// more than types, the last one in range.
std::vector<std::uint32_t> append_cells(const VtkCells& cells, const TextScanner& scanner, ControlMesh& mesh,
                                        std::vector<std::string>& warnings);

}  // namespace ccslice
