// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh_import/polyhedra.h"

#include <algorithm>
#include <ranges>

#include "core/base/contains.h"
#include "core/mesh/cell_kind.h"

namespace ccslice {
namespace {

std::optional<CellKind> kind_of(std::span<const FaceRing> rings) {
  const auto sides = [](const LocalFace& face) -> std::size_t { return face.size; };
  for (const CellKindTraits& traits : kCellKinds) {
    if (std::ranges::is_permutation(rings, traits.topology.faces, {}, std::ranges::size, sides)) return traits.kind;
  }
  return std::nullopt;
}

/// The vertex outside the base that a face joins to `corner`.
std::optional<std::uint32_t> neighbour_above(std::span<const FaceRing> rings, const FaceRing& base,
                                             std::uint32_t corner) {
  for (const FaceRing& ring : rings) {
    const auto at = std::find(ring.begin(), ring.end(), corner);
    if (at == ring.end()) continue;
    const std::uint32_t next = at + 1 == ring.end() ? ring.front() : *(at + 1);
    const std::uint32_t before = at == ring.begin() ? ring.back() : *(at - 1);
    if (!contains(base, next)) return next;
    if (!contains(base, before)) return before;
  }
  return std::nullopt;
}

/// From its least vertex towards the lesser neighbour: the same for any start and direction.
FaceRing canonical(FaceRing ring) {
  std::rotate(ring.begin(), std::min_element(ring.begin(), ring.end()), ring.end());
  if (ring.back() < ring[1]) std::reverse(ring.begin() + 1, ring.end());
  return ring;
}

/// Whether the faces of the cell with these corners are the given ones.
bool has_faces(const CornersOfPolyhedron& cell, std::span<const FaceRing> rings) {
  std::vector<FaceRing> given, built;
  for (const FaceRing& ring : rings) given.push_back(canonical(ring));
  for (const LocalFace& face : cell_topology(cell.kind).faces) {
    FaceRing ring;
    for (int i = 0; i < face.size; ++i) {
      const std::uint8_t corner = face.corners[static_cast<std::size_t>(i)];
      ring.push_back(cell.corners[vtk_corner(cell.kind, corner)]);
    }
    built.push_back(canonical(ring));
  }
  return std::is_permutation(given.begin(), given.end(), built.begin(), built.end());
}

bool all_different(FaceRing vertices) {
  std::ranges::sort(vertices);
  return std::ranges::adjacent_find(vertices) == vertices.end();
}

/// A quadrilateral, and a triangle from each of its edges to one vertex.
std::optional<CornersOfPolyhedron> corners_of_pyramid(std::span<const FaceRing> rings) {
  const auto base = std::ranges::find(rings, std::size_t{4}, &FaceRing::size);
  if (rings.size() != 5 || base == rings.end()) return std::nullopt;
  const auto apex = neighbour_above(rings, *base, base->front());
  if (!apex) return std::nullopt;
  std::vector<FaceRing> built = {canonical(*base)}, given;
  for (std::size_t i = 0; i < 4; ++i) built.push_back(canonical({(*base)[i], (*base)[(i + 1) % 4], *apex}));
  for (const FaceRing& ring : rings) given.push_back(canonical(ring));
  if (!std::is_permutation(given.begin(), given.end(), built.begin(), built.end())) return std::nullopt;
  if (!all_different(*base)) return std::nullopt;
  CornersOfPolyhedron result{CellKind::kHex, FaceRing(base->rbegin(), base->rend())};
  result.corners.insert(result.corners.end(), 4, *apex);
  return result;
}

}  // namespace

std::optional<CornersOfPolyhedron> corners_of_polyhedron(std::span<const FaceRing> rings) {
  if (std::ranges::any_of(rings, [](const FaceRing& ring) { return ring.size() < 3; })) return std::nullopt;
  const std::optional<CellKind> kind = kind_of(rings);
  if (!kind) return corners_of_pyramid(rings);
  const auto base = std::ranges::min_element(rings, {}, std::ranges::size);
  CornersOfPolyhedron result{*kind, FaceRing(base->rbegin(), base->rend())};
  const std::size_t above = static_cast<std::size_t>(corner_count(*kind)) - base->size();
  for (std::size_t i = 0; i < above; ++i) {
    const auto corner = neighbour_above(rings, *base, result.corners[i]);
    if (!corner) return std::nullopt;
    result.corners.push_back(*corner);
  }
  if (!has_faces(result, rings) || !all_different(result.corners)) return std::nullopt;
  return result;
}

std::string describe_polyhedron(std::span<const FaceRing> rings) {
  const auto sides = [&](std::size_t size) {
    return std::count_if(rings.begin(), rings.end(), [&](const FaceRing& ring) { return ring.size() == size; });
  };
  return "a polyhedron of " + std::to_string(rings.size()) + " faces (" + std::to_string(sides(3)) + " triangles, " +
         std::to_string(sides(4)) +
         " quadrilaterals) that don't close to a hexahedron, a tetrahedron, a wedge or a pyramid";
}

}  // namespace ccslice
