// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The kinds of cells: the combinatorics of one (its edges, its faces and the three edges at each corner), and what
// contract and mesh files call it.
//
// CORNER NUMBERS. Control meshes come in VTK order. Inside the core a hexahedron's corner is its bits u + 2v + 4w, so
// that crossing a cell along an axis flips a bit; vtk_to_bits() converts (the permutation is its own inverse).
// Tetrahedra and wedges keep VTK order; a positively oriented one has det(p1 - p0, p2 - p0, p3 - p0) > 0.
//
// Faces list their corners counter-clockwise seen from outside. Face 2a + s of a hexahedron lies where axis a is s;
// edge 4a + i runs along axis a.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace ccslice {

/// Corners in VTK order: hex 0-3 bottom ring, 4-7 above them; tet 0-2 base, 3 apex; wedge 0-2, corner i+3 opposite i.
enum class CellKind : std::uint8_t { kHex = 0, kTet = 1, kWedge = 2 };

struct LocalFace {
  std::uint8_t size;
  std::array<std::uint8_t, 4> corners;
};

struct CellTopology {
  std::span<const LocalFace> faces;
  std::span<const std::array<std::uint8_t, 2>> edges;
  /// For each corner its three neighbours along edges, right-handed, the lowest-numbered one first. Hexahedra: along
  /// axes u, v, w instead (their children keep the parent's axes).
  std::span<const std::array<std::uint8_t, 3>> corner_neighbours;
};

inline constexpr std::array<std::uint8_t, 8> kVtkToBits = {0, 1, 3, 2, 4, 5, 7, 6};

/// VTK corner number <-> corner bits of a hexahedron.
constexpr std::uint8_t vtk_to_bits(std::uint8_t corner) { return kVtkToBits[corner]; }

namespace cell_tables {

inline constexpr std::array<LocalFace, 6> kHexFaces = {
    {{4, {0, 4, 6, 2}}, {4, {1, 3, 7, 5}}, {4, {0, 1, 5, 4}}, {4, {2, 6, 7, 3}}, {4, {0, 2, 3, 1}}, {4, {4, 5, 7, 6}}}};
inline constexpr std::array<std::array<std::uint8_t, 2>, 12> kHexEdges = {
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};
inline constexpr std::array<std::array<std::uint8_t, 3>, 8> kHexNeighbours = {
    {{1, 2, 4}, {0, 3, 5}, {3, 0, 6}, {2, 1, 7}, {5, 6, 0}, {4, 7, 1}, {7, 4, 2}, {6, 5, 3}}};

inline constexpr std::array<LocalFace, 4> kTetFaces = {
    {{3, {0, 2, 1, 0}}, {3, {0, 1, 3, 0}}, {3, {1, 2, 3, 0}}, {3, {2, 0, 3, 0}}}};
inline constexpr std::array<std::array<std::uint8_t, 2>, 6> kTetEdges = {
    {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}}};
inline constexpr std::array<std::array<std::uint8_t, 3>, 4> kTetNeighbours = {
    {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};

inline constexpr std::array<LocalFace, 5> kWedgeFaces = {
    {{3, {0, 2, 1, 0}}, {3, {3, 4, 5, 0}}, {4, {0, 1, 4, 3}}, {4, {1, 2, 5, 4}}, {4, {2, 0, 3, 5}}}};
inline constexpr std::array<std::array<std::uint8_t, 2>, 9> kWedgeEdges = {
    {{0, 1}, {1, 2}, {0, 2}, {3, 4}, {4, 5}, {3, 5}, {0, 3}, {1, 4}, {2, 5}}};
inline constexpr std::array<std::array<std::uint8_t, 3>, 6> kWedgeNeighbours = {
    {{1, 2, 3}, {0, 4, 2}, {0, 1, 5}, {0, 5, 4}, {1, 3, 5}, {2, 4, 3}}};

}  // namespace cell_tables

struct CellKindTraits {
  CellKind kind;
  std::string_view name;    // Of the contract's value, without CELL_KIND_.
  std::string_view plural;  // For people.
  std::uint16_t vtk_type;   // In VTK files.
  CellTopology topology;
};

inline constexpr std::array kCellKinds = {
    CellKindTraits{CellKind::kHex,
                   "HEX",
                   "hexahedra",
                   12,
                   {cell_tables::kHexFaces, cell_tables::kHexEdges, cell_tables::kHexNeighbours}},
    CellKindTraits{CellKind::kTet,
                   "TET",
                   "tetrahedra",
                   10,
                   {cell_tables::kTetFaces, cell_tables::kTetEdges, cell_tables::kTetNeighbours}},
    CellKindTraits{CellKind::kWedge,
                   "WEDGE",
                   "wedges",
                   13,
                   {cell_tables::kWedgeFaces, cell_tables::kWedgeEdges, cell_tables::kWedgeNeighbours}},
};

constexpr bool rows_are_numbered_by_kind() {
  for (std::size_t i = 0; i < kCellKinds.size(); ++i) {
    if (static_cast<std::size_t>(kCellKinds[i].kind) != i) return false;
  }
  return true;
}
static_assert(rows_are_numbered_by_kind());

constexpr const CellTopology& cell_topology(CellKind kind) {
  return kCellKinds[static_cast<std::size_t>(kind)].topology;
}

constexpr int corner_count(CellKind kind) { return static_cast<int>(cell_topology(kind).corner_neighbours.size()); }

/// The number of a corner in VTK order; the way back for hexahedra is the same.
constexpr std::uint8_t vtk_corner(CellKind kind, std::uint8_t corner) {
  return kind == CellKind::kHex ? vtk_to_bits(corner) : corner;
}

}  // namespace ccslice
