// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element types of Gmsh's files, with the numbers that its reference manual gives them. The corners of cells come
// first, in VTK's order.

#pragma once

#include <cstdint>

#include "core/mesh/cell_kind.h"

namespace ccslice {

enum class GmshRole : std::uint8_t { kFlat, kCell, kPyramid, kHighOrder };

/// An element type: how many nodes it has, and what it is to us.
struct GmshElementType {
  std::uint16_t number;
  std::uint8_t nodes;
  GmshRole role;
  CellKind kind = CellKind::kHex;
  bool second_order = false;
};

inline constexpr GmshElementType kGmshElementTypes[] = {
    {1, 2, GmshRole::kFlat},
    {2, 3, GmshRole::kFlat},
    {3, 4, GmshRole::kFlat},
    {4, 4, GmshRole::kCell, CellKind::kTet},
    {5, 8, GmshRole::kCell, CellKind::kHex},
    {6, 6, GmshRole::kCell, CellKind::kWedge},
    {7, 5, GmshRole::kPyramid},
    {8, 3, GmshRole::kFlat},
    {9, 6, GmshRole::kFlat},
    {10, 9, GmshRole::kFlat},
    {11, 10, GmshRole::kCell, CellKind::kTet, true},
    {12, 27, GmshRole::kCell, CellKind::kHex, true},
    {13, 18, GmshRole::kCell, CellKind::kWedge, true},
    {14, 14, GmshRole::kPyramid},
    {15, 1, GmshRole::kFlat},
    {16, 8, GmshRole::kFlat},
    {17, 20, GmshRole::kCell, CellKind::kHex, true},
    {18, 15, GmshRole::kCell, CellKind::kWedge, true},
    {19, 13, GmshRole::kPyramid},
    {20, 9, GmshRole::kFlat},
    {21, 10, GmshRole::kFlat},
    {22, 12, GmshRole::kFlat},
    {23, 15, GmshRole::kFlat},
    {24, 15, GmshRole::kFlat},
    {25, 21, GmshRole::kFlat},
    {26, 4, GmshRole::kFlat},
    {27, 5, GmshRole::kFlat},
    {28, 6, GmshRole::kFlat},
    {29, 20, GmshRole::kHighOrder},
    {30, 35, GmshRole::kHighOrder},
    {31, 56, GmshRole::kHighOrder},
    {92, 64, GmshRole::kHighOrder},
    {93, 125, GmshRole::kHighOrder},
};

}  // namespace ccslice
