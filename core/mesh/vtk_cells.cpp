// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/vtk_cells.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <iterator>
#include <map>
#include <optional>

#include "core/base/error.h"
#include "core/mesh/mid_nodes.h"

namespace ccslice {
namespace {

constexpr std::uint16_t kLastFlatType = 9;           // VTK_QUAD; below it are points, lines and faces.
constexpr std::uint16_t kVoxel = 11, kPyramid = 14;  // Other cells: CellKindTraits::vtk_type.
constexpr std::uint16_t kCurvedFlatTypes[] = {21, 22, 23, 28, 30, 34, 35, 36};
constexpr std::uint16_t kCurvedPyramids[] = {27, 37};

/// Cells of second order: their corners come first.
struct CurvedType {
  std::uint16_t type;
  CellKind kind;
  std::uint64_t points;
};
constexpr CurvedType kCurvedTypes[] = {{24, CellKind::kTet, 10}, {25, CellKind::kHex, 20},   {26, CellKind::kWedge, 15},
                                       {29, CellKind::kHex, 27}, {31, CellKind::kWedge, 12}, {32, CellKind::kWedge, 18},
                                       {33, CellKind::kHex, 24}};

const CurvedType* curved_type(std::uint16_t type) {
  const auto* found = std::ranges::find(kCurvedTypes, type, &CurvedType::type);
  return found == std::end(kCurvedTypes) ? nullptr : found;
}

bool is_flat(std::uint16_t type) {
  return type <= kLastFlatType || std::ranges::find(kCurvedFlatTypes, type) != std::end(kCurvedFlatTypes);
}

/// A voxel counts its corners along x, then y, then z; a hexahedron goes round each face.
constexpr std::array<int, 8> kVoxelToHex = {0, 1, 3, 2, 4, 5, 7, 6};

std::optional<CellKind> kind_of(std::uint16_t type) {
  if (type == kVoxel) return CellKind::kHex;
  if (const CurvedType* curved = curved_type(type)) return curved->kind;
  const auto found = std::ranges::find(kCellKinds, type, &CellKindTraits::vtk_type);
  if (found == kCellKinds.end()) return std::nullopt;
  return found->kind;
}

/// Cells by type: how many, and the first few ids.
struct Tally {
  std::size_t count = 0;
  std::vector<std::int64_t> first_ids;

  void add(std::size_t cell) {
    constexpr std::size_t kMostNamed = 5;
    if (count++ < kMostNamed) first_ids.push_back(static_cast<std::int64_t>(cell));
  }
  std::string ids() const {
    std::string text;
    for (const std::int64_t id : first_ids) text += (text.empty() ? "" : ", ") + std::to_string(id);
    return count > first_ids.size() ? text + ", ..." : text;
  }
};

[[noreturn]] void refuse(const VtkCells& cells, std::uint16_t type, const Tally& tally, const TextScanner& scanner) {
  const std::string s = tally.count == 1 ? "" : "s";
  const std::string what = type == kPyramid ? "pyramid" + s : "cell" + s + " of VTK type " + std::to_string(type);
  const std::string why =
      type == kPyramid
          ? "a pyramid never refines to hexahedra: split it into tetrahedra"
          : "only hexahedra (12), voxels (11), tetrahedra (10), wedges (13) and those of second order are read";
  scanner.fail_at(
      cells.type_places[static_cast<std::size_t>(tally.first_ids.front())], ErrorCode::kMeshUnsupportedCell,
      std::to_string(tally.count) + " " + what + " (cell" + s + " " + tally.ids() + ", counted from 0); " + why,
      "cells", tally.first_ids);
}

void append_cell(const VtkCells& cells, std::size_t cell, CellKind kind, const TextScanner& scanner,
                 ControlMesh& mesh) {
  const std::uint64_t begin = cells.offsets[cell];
  const auto corners = static_cast<std::uint64_t>(corner_count(kind));
  const CurvedType* curved = curved_type(cells.types[cell]);
  const std::uint64_t points = curved != nullptr ? curved->points : corners;
  if (cells.offsets[cell + 1] - begin != points) {
    scanner.fail_at(cells.places[cell], ErrorCode::kFileSyntax,
                    "cell " + std::to_string(cell) + " (from 0) is of VTK type " + std::to_string(cells.types[cell]) +
                        ", which has " + std::to_string(points) + (curved != nullptr ? " points" : " corners") +
                        ", but lists " + std::to_string(cells.offsets[cell + 1] - begin),
                    "cells", {static_cast<std::int64_t>(cell)});
  }
  const bool voxel = cells.types[cell] == kVoxel;
  for (std::uint64_t i = 0; i < corners; ++i) {
    const std::uint64_t corner = voxel ? static_cast<std::uint64_t>(kVoxelToHex[i]) : i;
    mesh.cell_vertices.push_back(cells.connectivity[begin + corner]);
  }
  mesh.cell_kinds.push_back(kind);
}

}  // namespace

std::vector<std::uint32_t> append_cells(const VtkCells& cells, const TextScanner& scanner, ControlMesh& mesh,
                                        std::vector<std::string>& warnings) {
  std::vector<std::uint32_t> appended;
  Tally flat;
  std::size_t second_order = 0;
  std::map<std::uint16_t, Tally> unsupported;
  for (std::size_t cell = 0; cell < cells.types.size(); ++cell) {
    if (const std::optional<CellKind> kind = kind_of(cells.types[cell])) {
      append_cell(cells, cell, *kind, scanner, mesh);
      appended.push_back(static_cast<std::uint32_t>(cell));
      second_order += curved_type(cells.types[cell]) != nullptr;
    } else if (is_flat(cells.types[cell])) {
      flat.add(cell);
    } else {
      const bool pyramid = std::ranges::find(kCurvedPyramids, cells.types[cell]) != std::end(kCurvedPyramids);
      unsupported[pyramid ? kPyramid : cells.types[cell]].add(cell);
    }
  }
  if (const auto pyramids = unsupported.find(kPyramid); pyramids != unsupported.end())
    refuse(cells, kPyramid, pyramids->second, scanner);
  if (!unsupported.empty()) refuse(cells, unsupported.begin()->first, unsupported.begin()->second, scanner);
  if (second_order > 0) warnings.push_back(corners_only_note(second_order));
  if (flat.count > 0) {
    warnings.push_back(std::to_string(flat.count) + " points, lines or faces among the cells left out (cells " +
                       flat.ids() + "); cell ids in later messages count volume cells only");
  }
  return appended;
}

}  // namespace ccslice
