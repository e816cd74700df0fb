// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element types of Abaqus and CalculiX that have the topology of a solid, by family and number of nodes: "C3D20R"
// is of the family C3D and has 20; letters for variants follow. The corners come first, then the nodes of the edges,
// both in VTK's order [Abaqus, Three-Dimensional Solid Element Library; CalculiX, Element Types].

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
  bool may_be_flat = false;  // Its lower and upper faces may lie on each other.
};

/// With a V in its name, a wedge has nodes in the middle of some faces.
inline constexpr AbaqusSolidType kAbaqusSolidTypes[] = {
    {4, 4, CellKind::kTet},           {5, 5, std::nullopt},           {6, 6, CellKind::kWedge},
    {8, 8, CellKind::kHex},           {10, 10, CellKind::kTet, true}, {13, 13, std::nullopt, true},
    {15, 15, CellKind::kWedge, true}, {20, 20, CellKind::kHex, true}, {27, 27, CellKind::kHex, true}};

enum class AbaqusRole {
  kSolid,      // A cell, unless its type has another number of nodes than those above.
  kUnread,     // A piece of volume of a shape, or with an order of nodes, that isn't known here.
  kAmbiguous,  // A tetrahedron in CalculiX, a surface in Abaqus.
  kFlat        // Anything else.
};

struct AbaqusFamily {
  std::string_view prefix;  // Digits follow.
  bool may_be_flat = false;
};

/// Stress with all that couples to it (temperature, pore pressure, piezoelectricity) and user elements of solids; heat,
/// acoustics, Eulerian and electromagnetic elements, Abaqus's fluids and CalculiX's; solid shells and continuum shells;
/// cohesive elements and gaskets.
inline constexpr AbaqusFamily kAbaqusSolidFamilies[] = {
    {"C3D"},  {"DC3D"}, {"DCC3D"}, {"Q3D"}, {"AC3D"},        {"EC3D"},        {"EMC3D"},
    {"FC3D"}, {"F3D"},  {"CSS"},   {"SC"},  {"COH3D", true}, {"COD3D", true}, {"GK3D", true}};
/// Cylindrical, infinite and particle elements.
inline constexpr std::string_view kAbaqusUnreadFamilies[] = {"CCL", "CIN3D", "PC3D"};

struct AbaqusElementType {
  AbaqusRole role = AbaqusRole::kFlat;
  std::size_t nodes = 0;  // In its name.
  bool may_be_flat = false;
  bool has_nodes_in_faces = false;
};

/// `type` is in capitals.
inline AbaqusElementType abaqus_element_type(std::string_view type) {
  const auto number_behind = [&](std::string_view prefix, std::size_t& nodes) -> const char* {
    if (!type.starts_with(prefix)) return nullptr;
    const char* const digits = type.data() + prefix.size();
    const char* const end = std::from_chars(digits, type.data() + type.size(), nodes).ptr;
    return end == digits ? nullptr : end;
  };
  AbaqusElementType found;
  for (const AbaqusFamily& family : kAbaqusSolidFamilies) {
    const char* const letters = number_behind(family.prefix, found.nodes);
    if (letters == nullptr) continue;
    const std::string_view variant(letters, static_cast<std::size_t>(type.data() + type.size() - letters));
    found.role = AbaqusRole::kSolid;
    found.may_be_flat = family.may_be_flat;
    found.has_nodes_in_faces = variant.starts_with('V');
    if (family.prefix == "F3D" && found.nodes <= 4) {
      found.role = found.nodes == 4 ? AbaqusRole::kAmbiguous : AbaqusRole::kFlat;
    } else if (family.prefix == "GK3D" && (found.nodes == 2 || variant.starts_with('L'))) {
      found.role = AbaqusRole::kFlat;  // Between two nodes, or two lines.
    } else if (family.prefix == "GK3D" && found.nodes > 8) {
      found.role = AbaqusRole::kUnread;
    }
    return found;
  }
  for (const std::string_view family : kAbaqusUnreadFamilies) {
    if (number_behind(family, found.nodes) != nullptr) found.role = AbaqusRole::kUnread;
  }
  return found;
}

/// The number of nodes is that of a solid's type. Nothing if no such solid is known.
inline std::optional<AbaqusSolidType> abaqus_solid(const AbaqusElementType& type) {
  for (AbaqusSolidType solid : kAbaqusSolidTypes) {
    if (solid.nodes != type.nodes) continue;
    solid.may_be_flat = type.may_be_flat;
    if (solid.nodes == 15 && type.has_nodes_in_faces) solid.most_nodes = 18;
    if (solid.nodes == 27) solid.nodes = 21;
    return solid;
  }
  return std::nullopt;
}

}  // namespace ccslice
