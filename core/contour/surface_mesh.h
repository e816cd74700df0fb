// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The mesh of leaves that adaptive halving makes of the boundary faces, as far as it is needed: the vertices.
//
// Halving a box of a face puts vertices at the middles of its four sides. So the middle of a leaf's side is a vertex
// if, and only if, somebody finer meets the leaf there, and halving sides as long as their middles are vertices gives
// the finest edges, each shared by exactly two leaves (T-VERTICES included). A face that is itself a part of a coarser
// neighbour's side enters the middles of that side's halvings down to its own.

#pragma once

#include <array>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "core/contour/id_table.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// Boxes aren't halved below this: 2^-28 of a face.
inline constexpr std::uint32_t kSmallestBox = 8;

/// A dyadic box of a face's frame, fixed point: [s, s + size] x [t, t + size].
struct SurfaceBox {
  BoundaryFaceId face;
  std::uint32_t s = 0, t = 0;
  std::uint32_t size = kSurfaceOne;

  SurfaceBox quarter(int i, int j) const { return {face, s + i * (size / 2), t + j * (size / 2), size / 2}; }
  /// (s,t) of corner 0-3, counter-clockwise from (0,0).
  std::array<std::uint32_t, 2> corner(int k) const {
    return {s + (k == 1 || k == 2 ? size : 0), t + (k >= 2 ? size : 0)};
  }
};

/// A vertex on the rim of a leaf.
struct RimVertex {
  std::uint32_t id = IdTable<SurfaceKey>::kNone;
  std::uint32_t s = 0, t = 0;
};

/// Calls visit(side, from, to) for each finest edge of a leaf's side between two vertices. vertex_at(s, t): the id of
/// the vertex there, or kNone.
template <class VertexAt, class Visit>
void walk_side(int side, const RimVertex& from, const RimVertex& to, const VertexAt& vertex_at, Visit& visit) {
  const std::uint32_t s = std::midpoint(from.s, to.s), t = std::midpoint(from.t, to.t);
  const bool finest = (from.s ^ to.s ^ from.t ^ to.t) % 2 != 0;
  const RimVertex middle{finest ? IdTable<SurfaceKey>::kNone : vertex_at(s, t), s, t};
  if (middle.id == IdTable<SurfaceKey>::kNone) return visit(side, from, to);
  walk_side(side, from, middle, vertex_at, visit);
  walk_side(side, middle, to, vertex_at, visit);
}

class SurfaceVertices {
 public:
  explicit SurfaceVertices(const BoundarySurface& surface) : surface_(surface) {}

  void clear() { table_.clear(); }
  void reserve(std::size_t count) { table_.reserve(count); }
  std::size_t size() const { return table_.size(); }

  std::pair<std::uint32_t, bool> insert(BoundaryFaceId face, std::uint32_t s, std::uint32_t t) {
    return table_.insert(surface_.key(face, s, t));
  }
  /// The vertex's id, or kNone.
  std::uint32_t find(BoundaryFaceId face, std::uint32_t s, std::uint32_t t) const {
    return table_.find(surface_.key(face, s, t));
  }

  /// Enters the middles of a box's sides: of side 0-3.
  std::array<std::uint32_t, 4> enter_middles(const SurfaceBox& box);
  /// Enters what coarser neighbours must know about a face when its boxes are halved, and appends it.
  void enter_coarser_middles(BoundaryFaceId face, std::vector<std::uint32_t>& middles);

  /// Calls visit(side, from, to) for each finest edge round a leaf, counter-clockwise. REQUIRES: the leaf's corners and
  /// all halvings of its neighbours are entered.
  template <class Visit>
  void walk_rim(const SurfaceBox& leaf, Visit&& visit) const {
    const auto vertex_at = [&](std::uint32_t s, std::uint32_t t) { return find(leaf.face, s, t); };
    std::array<RimVertex, 4> corners;
    for (int k = 0; k < 4; ++k) {
      const auto [s, t] = leaf.corner(k);
      corners[k] = {vertex_at(s, t), s, t};
    }
    for (int k = 0; k < 4; ++k) walk_side(k, corners[k], corners[(k + 1) % 4], vertex_at, visit);
  }

 private:
  const BoundarySurface& surface_;
  IdTable<SurfaceKey> table_;
};

}  // namespace ccslice
