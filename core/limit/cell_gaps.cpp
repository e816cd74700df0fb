// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/cell_gaps.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/limit/solid_data.h"

namespace ccslice {
namespace {

constexpr std::size_t kMostWithoutFace = 3;  // Round the inner corner of a slit.

/// The vertices that two control cells share.
struct SharedVertices {
  std::size_t count = 0;
  std::array<std::uint32_t, kMostWithoutFace> first{};  // Of them.

  SharedVertices(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
    for (const std::uint32_t vertex : a) {
      if (std::ranges::find(b, vertex) == b.end()) continue;
      if (count < first.size()) first[count] = vertex;
      ++count;
    }
  }
  std::span<const std::uint32_t> few() const { return std::span(first).first(std::min(count, first.size())); }
};

/// Whether these are a triangle of the cell: any three of a tetrahedron, one end of a wedge.
bool is_triangle(std::span<const std::uint32_t> three, std::span<const std::uint32_t> cell) {
  constexpr std::size_t kTetrahedron = 4, kWedge = 6;
  if (cell.size() != kWedge) return cell.size() == kTetrahedron;
  const auto is_of = [&](std::span<const std::uint32_t> end) { return SharedVertices(three, end).count == 3; };
  return is_of(cell.first(3)) || is_of(cell.last(3));
}

bool have_common_face(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
  const SharedVertices shared(a, b);
  if (shared.count != kMostWithoutFace) return shared.count > kMostWithoutFace;
  return is_triangle(shared.few(), a) && is_triangle(shared.few(), b);
}

/// Calls visit(outwards) for each of the cell's faces on the boundary, by its Jacobian in the middle.
template <typename Visit>
void for_each_outwards(const LimitSolid& solid, LimitCellId cell, Visit visit) {
  const unsigned sides = solid.boundary_sides(cell);
  const Mat3 inverse_jacobian = solid.index().cell_maps[cell].inverse_jacobian;
  for (std::size_t side = 0; side < 6; ++side) {
    const Vec3 rising = inverse_jacobian.row(static_cast<Eigen::Index>(side / 2));
    if (sides >> side & 1) visit(side % 2 != 0 ? rising : -rising);
  }
}

/// A face that one cell has on the boundary looks to where the other one is, and that one has a face that looks back.
bool are_face_to_face(const LimitSolid& solid, LimitCellId here, LimitCellId there) {
  const CellMaps& maps = solid.index().cell_maps;
  const Vec3 way = maps[there].middle - maps[here].middle;
  bool any = false;
  for_each_outwards(solid, here, [&](const Vec3& outwards) {
    any = any || (outwards.dot(way) > 0 && looks_back(solid, there, outwards));
  });
  return any;
}

}  // namespace

bool is_across_a_gap(const LimitSolid& solid, LimitCellId here, LimitCellId there,
                     std::span<const LimitCellId> around) {
  const LimitSolid::Data& data = solid.data();
  const auto vertices = [&](LimitCellId cell) { return data.corners(solid.control_cell(cell)); };
  const auto share_face = [&](LimitCellId a, LimitCellId b) { return have_common_face(vertices(a), vertices(b)); };
  if (share_face(here, there)) return false;
  const SharedVertices shared(vertices(here), vertices(there));
  const bool on_boundary = std::ranges::all_of(
      shared.few(), [&](std::uint32_t vertex) { return data.boundary_vertices.find(vertex).has_value(); });
  if (!on_boundary) return false;
  std::vector<LimitCellId> next_to_here, next_to_there;
  for (const LimitCellId cell : around) {
    const ControlCellId control = solid.control_cell(cell);
    if (control == solid.control_cell(here) || control == solid.control_cell(there)) continue;
    if (SharedVertices(shared.few(), vertices(cell)).count < shared.count) continue;
    if (share_face(here, cell)) next_to_here.push_back(cell);
    if (share_face(there, cell)) next_to_there.push_back(cell);
  }
  // Inside of a part a cell goes on through both of its faces at an edge, on the boundary through one or none.
  const auto ends_here = [&](std::span<const LimitCellId> next) {
    return std::ranges::none_of(
        next, [&](LimitCellId cell) { return solid.control_cell(cell) != solid.control_cell(next.front()); });
  };
  if (shared.count == 2 && ends_here(next_to_here) && ends_here(next_to_there) &&
      are_face_to_face(solid, here, there)) {
    return true;
  }
  return std::ranges::none_of(next_to_here, [&](LimitCellId a) {
    return std::ranges::any_of(next_to_there, [&](LimitCellId b) {
      return solid.control_cell(a) == solid.control_cell(b) || (shared.count == 1 && share_face(a, b));
    });
  });
}

bool looks_back(const LimitSolid& solid, LimitCellId cell, const Vec3& direction) {
  constexpr double kAgainst = -0.5;  // Cosine.
  bool any = false;
  for_each_outwards(solid, cell, [&](const Vec3& outwards) {
    any = any || !(outwards.dot(direction) > kAgainst * outwards.norm() * direction.norm());
  });
  return any;
}

}  // namespace ccslice
