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

#include "core/contour/id_table.h"
#include "core/limit/boundary_surface.h"

namespace ccslice {

/// Boxes aren't halved below this: 2^-28 of a face.
inline constexpr std::uint32_t kSmallestBox = 8;

/// A dyadic box of a face's frame, fixed point: [s, s + size] x [t, t + size].
struct SurfaceBox {
  std::uint32_t face = 0;
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

class SurfaceVertices {
 public:
  explicit SurfaceVertices(const BoundarySurface& surface) : surface_(surface) {}

  void clear() { table_.clear(); }
  std::size_t size() const { return table_.size(); }

  std::pair<std::uint32_t, bool> insert(std::uint32_t face, std::uint32_t s, std::uint32_t t) {
    return table_.insert(surface_.key(face, s, t));
  }

  /// Enters what coarser neighbours must know about a face. Before its boxes are halved.
  void enter_face(std::uint32_t face);
  /// Enters the middles of a box's sides.
  void enter_halving(const SurfaceBox& box);

  /// Calls visit(side, from, to) for each finest edge round a leaf, counter-clockwise. REQUIRES: the leaf's corners and
  /// all halvings of its neighbours are entered.
  template <class Visit>
  void walk_rim(const SurfaceBox& leaf, Visit&& visit) const {
    std::array<RimVertex, 4> corners;
    for (int k = 0; k < 4; ++k) corners[k] = vertex(leaf.face, leaf.corner(k));
    for (int k = 0; k < 4; ++k) walk_side(leaf.face, k, corners[k], corners[(k + 1) % 4], visit);
  }

 private:
  RimVertex vertex(std::uint32_t face, const std::array<std::uint32_t, 2>& at) const {
    return {table_.find(surface_.key(face, at[0], at[1])), at[0], at[1]};
  }

  template <class Visit>
  void walk_side(std::uint32_t face, int side, const RimVertex& from, const RimVertex& to, Visit& visit) const {
    const std::uint32_t s = std::midpoint(from.s, to.s), t = std::midpoint(from.t, to.t);
    const bool finest = (from.s ^ to.s ^ from.t ^ to.t) % 2 != 0;
    const RimVertex middle = finest ? RimVertex{} : vertex(face, {s, t});
    if (middle.id == IdTable<SurfaceKey>::kNone) return visit(side, from, to);
    walk_side(face, side, from, middle, visit);
    walk_side(face, side, middle, to, visit);
  }

  const BoundarySurface& surface_;
  IdTable<SurfaceKey> table_;
};

}  // namespace ccslice
