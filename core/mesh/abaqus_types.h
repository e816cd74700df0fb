// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Abaqus's element types that have the topology of a solid, by family and number of nodes: "C3D20R" is of the family
// C3D and has 20; letters for variants follow. The corners come first, in VTK's order.

#pragma once

#include <charconv>
#include <cstddef>
#include <optional>
#include <string_view>

#include "core/mesh/cell_kind.h"

namespace ccslice {

struct AbaqusSolidType {
  std::size_t nodes, most_nodes;  // Some have nodes in the middle of faces, as many as the user likes.
  std::optional<CellKind> kind;   // None: a pyramid.
  bool second_order = false;
};

inline constexpr AbaqusSolidType kAbaqusSolidTypes[] = {
    {4, 4, CellKind::kTet},           {5, 5, std::nullopt},           {6, 6, CellKind::kWedge},
    {8, 8, CellKind::kHex},           {10, 10, CellKind::kTet, true}, {13, 13, std::nullopt, true},
    {15, 18, CellKind::kWedge, true}, {20, 20, CellKind::kHex, true}, {21, 27, CellKind::kHex, true}};

/// Stress, heat, heat with convection, acoustics, Eulerian, continuum shells.
inline constexpr std::string_view kAbaqusSolidFamilies[] = {"C3D", "DC3D", "DCC3D", "AC3D", "EC3D", "SC"};

/// The number of nodes in the name of a solid's type, in capitals; nothing for other types.
inline std::optional<std::size_t> abaqus_solid_nodes(std::string_view type) {
  for (const std::string_view family : kAbaqusSolidFamilies) {
    if (!type.starts_with(family)) continue;
    std::size_t nodes = 0;
    const char* digits = type.data() + family.size();
    if (std::from_chars(digits, type.data() + type.size(), nodes).ptr != digits) return nodes;
  }
  return std::nullopt;
}

}  // namespace ccslice
