// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/collapsed_shape.h"

#include <cstddef>
#include <set>
#include <utility>

#include "core/base/contains.h"
#include "core/mesh_import/polyhedra.h"

namespace ccslice {
namespace {

/// Returns the faces that are left once repeated corners are one.
std::vector<FaceRing> faces_left(CellKind kind, std::span<const std::uint32_t> corners) {
  std::vector<FaceRing> rings;
  for (const LocalFace& face : cell_topology(kind).faces) {
    FaceRing ring;
    const auto whole = corners_of_face(kind, face, corners);
    for (std::size_t i = 0; i < face.size; ++i) {
      if (ring.empty() || ring.back() != whole[i]) ring.push_back(whole[i]);
    }
    while (ring.size() > 1 && ring.back() == ring.front()) ring.pop_back();
    if (ring.size() > 2) rings.push_back(std::move(ring));
  }
  return rings;
}

/// Two triangles that close a quadrilateral: between two corners of theirs runs an edge of the tetrahedron, which no
/// face shows.
std::optional<CollapsedCell> tet_over_quadrilateral(std::span<const FaceRing> rings, std::size_t vertices) {
  const auto quadrilateral = std::ranges::find(rings, std::size_t{4}, &FaceRing::size);
  if (rings.size() != 3 || vertices != 4 || quadrilateral == rings.end()) return std::nullopt;
  if (std::ranges::count(rings, std::size_t{3}, &FaceRing::size) != 2) return std::nullopt;
  CollapsedCell result{CollapsedShape::kTetOverQuadrilateral, CellKind::kTet, *quadrilateral};
  std::ranges::copy(*quadrilateral, result.base.begin());
  const auto in_one_triangle = [&](std::uint32_t vertex) {
    return std::ranges::count_if(rings, [&](const FaceRing& ring) { return contains(ring, vertex); }) == 2;
  };
  const std::size_t from = in_one_triangle(result.base[0]) ? 0 : 1;
  for (std::size_t i = 0; i < 4; ++i) {
    if (in_one_triangle(result.base[i]) != (i % 2 == from)) return std::nullopt;
  }
  result.diagonal_of_tet = sorted_ends(result.base[from], result.base[from + 2]);
  return result;
}

}  // namespace

bool has_repeated_corner(std::span<const std::uint32_t> corners) {
  for (std::size_t i = 1; i < corners.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (corners[i] == corners[k]) return true;
    }
  }
  return false;
}

std::array<std::uint32_t, 4> corners_of_face(CellKind kind, const LocalFace& face,
                                             std::span<const std::uint32_t> corners) {
  std::array<std::uint32_t, 4> ring{};
  for (std::size_t i = 0; i < face.size; ++i) ring[i] = corners[vtk_corner(kind, face.corners[i])];
  return ring;
}

std::optional<CollapsedCell> what_is_left(CellKind kind, std::span<const std::uint32_t> corners) {
  const std::set<std::uint32_t> vertices(corners.begin(), corners.end());
  const std::vector<FaceRing> rings = faces_left(kind, corners);
  if (auto tet = tet_over_quadrilateral(rings, vertices.size())) return tet;
  const std::optional<CornersOfPolyhedron> found = corners_of_polyhedron(rings);
  if (!found) return std::nullopt;
  CollapsedCell result{CollapsedShape::kCell, found->kind, found->corners};
  if (found->kind == CellKind::kHex) {
    if (found->corners[4] != found->corners[7]) return std::nullopt;  // As many faces as before.
    result.shape = CollapsedShape::kPyramid;
    result.kind = CellKind::kTet;
    result.corners.resize(5);
    std::copy_n(result.corners.begin(), 4, result.base.begin());
  }
  const bool whole =
      std::set(result.corners.begin(), result.corners.end()) == vertices && result.corners.size() == vertices.size();
  return whole ? std::optional(result) : std::nullopt;
}

}  // namespace ccslice
