// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The sections of MEDIT files that hold meshes, and how many numbers an entry has in them [libMeshb, libmeshb7.c,
// GmfKwdFmt]. A reference is the last one.

#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "core/mesh/cell_kind.h"

namespace ccslice {

/// A section of cells, whose corners come first unless its ordering says something else (medit_high_order.h).
struct MeditCells {
  std::string_view keyword;
  CellKind kind;
  std::uint8_t nodes, order = 1;
};

inline constexpr MeditCells kMeditCells[] = {
    {"Tetrahedra", CellKind::kTet, 4},       {"Prisms", CellKind::kWedge, 6},
    {"Hexahedra", CellKind::kHex, 8},        {"TetrahedraP2", CellKind::kTet, 10, 2},
    {"PrismsP2", CellKind::kWedge, 18, 2},   {"HexahedraQ2", CellKind::kHex, 27, 2},
    {"TetrahedraP3", CellKind::kTet, 20, 3}, {"PrismsP3", CellKind::kWedge, 40, 3},
    {"HexahedraQ3", CellKind::kHex, 64, 3},  {"TetrahedraP4", CellKind::kTet, 35, 4},
    {"PrismsP4", CellKind::kWedge, 75, 4},   {"HexahedraQ4", CellKind::kHex, 125, 4},
};

/// Sections of volume that aren't read.
struct MeditRefused {
  std::string_view keyword, plural, remedy;
};

inline constexpr std::string_view kMeditPyramidRemedy =
    "a pyramid never refines to hexahedra: split it into tetrahedra";
inline constexpr std::string_view kMeditRemedy = "write hexahedra, prisms or tetrahedra in their place";
inline constexpr MeditRefused kMeditRefused[] = {
    {"PyramidsP2", "pyramids", kMeditPyramidRemedy},       {"PyramidsP3", "pyramids", kMeditPyramidRemedy},
    {"PyramidsP4", "pyramids", kMeditPyramidRemedy},       {"Prisms9", "cells of Prisms9", kMeditRemedy},
    {"Hexahedra12", "cells of Hexahedra12", kMeditRemedy}, {"Polyhedra", "polyhedra", kMeditRemedy},
    {"PolyhedraHeaders", "polyhedra", kMeditRemedy},
};

/// Sections that say nothing about the solid.
struct MeditSkipped {
  std::string_view keyword;
  int tokens_per_entry;
};

inline constexpr MeditSkipped kMeditSkipped[] = {
    {"Edges", 3},
    {"EdgesP2", 4},
    {"EdgesP3", 5},
    {"EdgesP4", 6},
    {"Triangles", 4},
    {"TrianglesP2", 7},
    {"TrianglesP3", 11},
    {"TrianglesP4", 16},
    {"Quadrilaterals", 5},
    {"Quadrilaterals6", 7},
    {"QuadrilateralsQ2", 10},
    {"QuadrilateralsQ3", 17},
    {"QuadrilateralsQ4", 26},
    {"Corners", 1},
    {"Ridges", 1},
    {"RequiredVertices", 1},
    {"RequiredEdges", 1},
    {"RequiredTriangles", 1},
    {"RequiredQuadrilaterals", 1},
    {"Normals", 3},
    {"NormalAtVertices", 2},
    {"NormalAtTriangleVertices", 3},
    {"NormalAtQuadrilateralVertices", 4},
    {"Tangents", 3},
    {"TangentAtVertices", 2},
    {"TangentAtEdgeVertices", 3},
};

}  // namespace ccslice
