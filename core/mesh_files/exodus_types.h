// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element types of Exodus files [SEACAS, exodus-element-types.md]. A name may end in the number of nodes, in upper
// or lower case. The corners come first, in VTK's order; then the nodes of the edges, those along w before the upper
// ones [Ioss_Hex27.C, Ioss_Wedge21.C, ...: edge_node_order, face_node_order].

#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "core/base/similar_name.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh_import/text_scanner.h"

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

/// Null for a type that isn't known.
inline const ExodusElementType* exodus_element_type(std::string_view name) {
  const auto* const found = std::ranges::find_if(kExodusElementTypes, [&](const ExodusElementType& type) {
    return equals_ignoring_case(name.substr(0, type.prefix.size()), type.prefix);
  });
  return found == kExodusElementTypes.end() || found->role == ExodusRole::kUnknown ? nullptr : found;
}

namespace exodus_tables {

inline constexpr std::uint8_t kNo = 255;  // Such an element has no node there.
inline constexpr std::array<std::uint8_t, 6> kTet = {4, 5, 6, 7, 8, 9};
inline constexpr std::array<std::uint8_t, 9> kWedge12 = {6, 7, 8, 9, 10, 11, kNo, kNo, kNo};
inline constexpr std::array<std::uint8_t, 12> kWedge18 = {6, 7, 8, 12, 13, 14, 9, 10, 11, 15, 16, 17};
inline constexpr std::array<std::uint8_t, 12> kWedge20 = {6, 7, 8, 12, 13, 14, 9, 10, 11, 19, 17, 18};
inline constexpr std::array<std::uint8_t, 12> kWedge21 = {6, 7, 8, 12, 13, 14, 9, 10, 11, 20, 18, 19};
inline constexpr std::array<std::uint8_t, 12> kHex16 = {8, 9, 10, 11, 12, 13, 14, 15, kNo, kNo, kNo, kNo};
inline constexpr std::array<std::uint8_t, 19> kHex27 = {8,  9,  10, 11, 16, 17, 18, 19, 12, 13,
                                                        14, 15, 23, 24, 25, 26, 21, 22, 20};

}  // namespace exodus_tables

/// Which nodes of a cell with so many of them are those of SecondOrderCells, in their order. Nothing for cells of other
/// orders.
constexpr std::span<const std::uint8_t> exodus_mid_nodes(CellKind kind, std::uint64_t nodes) {
  using namespace exodus_tables;
  if (kind == CellKind::kTet) {
    const bool second_order = nodes == 10 || nodes == 11 || nodes == 14 || nodes == 15;
    return std::span<const std::uint8_t>(kTet).first(second_order ? kTet.size() : 0);
  }
  if (kind == CellKind::kWedge) {
    if (nodes == 12) return kWedge12;
    if (nodes == 15 || nodes == 16) return std::span<const std::uint8_t>(kWedge18).first(9);
    if (nodes == 18) return kWedge18;
    if (nodes == 20) return kWedge20;
    return std::span<const std::uint8_t>(kWedge21).first(nodes == 21 ? kWedge21.size() : 0);
  }
  if (nodes == 16) return kHex16;
  if (nodes == 20) return std::span<const std::uint8_t>(kHex27).first(12);
  return std::span<const std::uint8_t>(kHex27).first(nodes == 27 ? kHex27.size() : 0);
}

}  // namespace ccslice
