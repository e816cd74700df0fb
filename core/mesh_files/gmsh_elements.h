// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The element types of Gmsh's files, with the numbers, nodes and orders that its source gives them [GmshDefines.h,
// ElementType.cpp]. The corners of cells come first, in VTK's order; then the nodes of their edges, quadrilaterals and
// inside [MTetrahedron.h, MPrism.h, MHexahedron.h: edges_tetra, faces_prism, ...].

#pragma once

#include <array>
#include <cstdint>
#include <span>

#include "core/mesh/cell_kind.h"

namespace ccslice {

enum class GmshRole : std::uint8_t { kFlat, kCell, kPyramid };

/// An element type: how many nodes it has, and what it is to us.
struct GmshElementType {
  std::uint16_t number;
  std::uint16_t nodes;
  GmshRole role;
  CellKind kind = CellKind::kHex;
  std::uint8_t order = 1;
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
    {11, 10, GmshRole::kCell, CellKind::kTet, 2},
    {12, 27, GmshRole::kCell, CellKind::kHex, 2},
    {13, 18, GmshRole::kCell, CellKind::kWedge, 2},
    {14, 14, GmshRole::kPyramid},
    {15, 1, GmshRole::kFlat},
    {16, 8, GmshRole::kFlat},
    {17, 20, GmshRole::kCell, CellKind::kHex, 2},
    {18, 15, GmshRole::kCell, CellKind::kWedge, 2},
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
    {29, 20, GmshRole::kCell, CellKind::kTet, 3},
    {30, 35, GmshRole::kCell, CellKind::kTet, 4},
    {31, 56, GmshRole::kCell, CellKind::kTet, 5},
    {32, 22, GmshRole::kCell, CellKind::kTet, 4},
    {33, 28, GmshRole::kCell, CellKind::kTet, 5},
    {36, 16, GmshRole::kFlat},
    {37, 25, GmshRole::kFlat},
    {38, 36, GmshRole::kFlat},
    {39, 12, GmshRole::kFlat},
    {40, 16, GmshRole::kFlat},
    {41, 20, GmshRole::kFlat},
    {42, 28, GmshRole::kFlat},
    {43, 36, GmshRole::kFlat},
    {44, 45, GmshRole::kFlat},
    {45, 55, GmshRole::kFlat},
    {46, 66, GmshRole::kFlat},
    {47, 49, GmshRole::kFlat},
    {48, 64, GmshRole::kFlat},
    {49, 81, GmshRole::kFlat},
    {50, 100, GmshRole::kFlat},
    {51, 121, GmshRole::kFlat},
    {52, 18, GmshRole::kFlat},
    {53, 21, GmshRole::kFlat},
    {54, 24, GmshRole::kFlat},
    {55, 27, GmshRole::kFlat},
    {56, 30, GmshRole::kFlat},
    {57, 24, GmshRole::kFlat},
    {58, 28, GmshRole::kFlat},
    {59, 32, GmshRole::kFlat},
    {60, 36, GmshRole::kFlat},
    {61, 40, GmshRole::kFlat},
    {62, 7, GmshRole::kFlat},
    {63, 8, GmshRole::kFlat},
    {64, 9, GmshRole::kFlat},
    {65, 10, GmshRole::kFlat},
    {66, 11, GmshRole::kFlat},
    {71, 84, GmshRole::kCell, CellKind::kTet, 6},
    {72, 120, GmshRole::kCell, CellKind::kTet, 7},
    {73, 165, GmshRole::kCell, CellKind::kTet, 8},
    {74, 220, GmshRole::kCell, CellKind::kTet, 9},
    {75, 286, GmshRole::kCell, CellKind::kTet, 10},
    {79, 34, GmshRole::kCell, CellKind::kTet, 6},
    {80, 40, GmshRole::kCell, CellKind::kTet, 7},
    {81, 46, GmshRole::kCell, CellKind::kTet, 8},
    {82, 52, GmshRole::kCell, CellKind::kTet, 9},
    {83, 58, GmshRole::kCell, CellKind::kTet, 10},
    {90, 40, GmshRole::kCell, CellKind::kWedge, 3},
    {91, 75, GmshRole::kCell, CellKind::kWedge, 4},
    {92, 64, GmshRole::kCell, CellKind::kHex, 3},
    {93, 125, GmshRole::kCell, CellKind::kHex, 4},
    {94, 216, GmshRole::kCell, CellKind::kHex, 5},
    {95, 343, GmshRole::kCell, CellKind::kHex, 6},
    {96, 512, GmshRole::kCell, CellKind::kHex, 7},
    {97, 729, GmshRole::kCell, CellKind::kHex, 8},
    {98, 1000, GmshRole::kCell, CellKind::kHex, 9},
    {99, 32, GmshRole::kCell, CellKind::kHex, 3},
    {100, 44, GmshRole::kCell, CellKind::kHex, 4},
    {101, 56, GmshRole::kCell, CellKind::kHex, 5},
    {102, 68, GmshRole::kCell, CellKind::kHex, 6},
    {103, 80, GmshRole::kCell, CellKind::kHex, 7},
    {104, 92, GmshRole::kCell, CellKind::kHex, 8},
    {105, 104, GmshRole::kCell, CellKind::kHex, 9},
    {106, 126, GmshRole::kCell, CellKind::kWedge, 5},
    {107, 196, GmshRole::kCell, CellKind::kWedge, 6},
    {108, 288, GmshRole::kCell, CellKind::kWedge, 7},
    {109, 405, GmshRole::kCell, CellKind::kWedge, 8},
    {110, 550, GmshRole::kCell, CellKind::kWedge, 9},
    {111, 24, GmshRole::kCell, CellKind::kWedge, 3},
    {112, 33, GmshRole::kCell, CellKind::kWedge, 4},
    {113, 42, GmshRole::kCell, CellKind::kWedge, 5},
    {114, 51, GmshRole::kCell, CellKind::kWedge, 6},
    {115, 60, GmshRole::kCell, CellKind::kWedge, 7},
    {116, 69, GmshRole::kCell, CellKind::kWedge, 8},
    {117, 78, GmshRole::kCell, CellKind::kWedge, 9},
    {118, 30, GmshRole::kPyramid},
    {119, 55, GmshRole::kPyramid},
    {120, 91, GmshRole::kPyramid},
    {121, 140, GmshRole::kPyramid},
    {122, 204, GmshRole::kPyramid},
    {123, 285, GmshRole::kPyramid},
    {124, 385, GmshRole::kPyramid},
    {125, 21, GmshRole::kPyramid},
    {126, 29, GmshRole::kPyramid},
    {127, 37, GmshRole::kPyramid},
    {128, 45, GmshRole::kPyramid},
    {129, 53, GmshRole::kPyramid},
    {130, 61, GmshRole::kPyramid},
    {131, 69, GmshRole::kPyramid},
    {137, 16, GmshRole::kCell, CellKind::kTet, 3},
};

namespace gmsh_tables {

inline constexpr std::array<std::uint8_t, 6> kTetMidNodes = {4, 5, 6, 7, 9, 8};
inline constexpr std::array<std::uint8_t, 12> kWedgeMidNodes = {6, 9, 7, 12, 14, 13, 8, 10, 11, 15, 17, 16};
inline constexpr std::array<std::uint8_t, 19> kHexMidNodes = {8,  11, 13, 9,  16, 18, 19, 17, 10, 12,
                                                              14, 15, 22, 23, 21, 24, 20, 25, 26};

}  // namespace gmsh_tables

/// Which nodes of a cell of second order are those of SecondOrderCells, in their order. Nothing for other types.
constexpr std::span<const std::uint8_t> gmsh_mid_nodes(const GmshElementType& type) {
  if (type.role != GmshRole::kCell || type.order != 2) return {};
  std::span<const std::uint8_t> all = gmsh_tables::kHexMidNodes;
  if (type.kind == CellKind::kTet) all = gmsh_tables::kTetMidNodes;
  if (type.kind == CellKind::kWedge) all = gmsh_tables::kWedgeMidNodes;
  return all.first(type.nodes - static_cast<std::size_t>(corner_count(type.kind)));
}

}  // namespace ccslice
