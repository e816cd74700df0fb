// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the sample models are put together from: control points of one channel, cells, and two ways to divide a
// hexahedron so that extraordinary vertices arise, both with conforming faces.
//
//   core    a hexahedron inside, joined to the six outer faces by six others: 7 cells, 8 extraordinary vertices,
//           20 extraordinary edges of 3 cells each
//   inset   a column from one face to the inside, with a cell on each side and one below its end: 6 cells,
//           4 extraordinary vertices, 12 extraordinary edges
//
// The scheme rounds and shrinks. But it commutes with affine maps: a model is designed in units of its own, the
// bounding box of its limit is measured once (`LimitSolid::summary()`), and finish() maps that box to the size wanted.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "core/mesh/control_mesh.h"

namespace ccslice {

class ModelBuilder {
 public:
  using Vertex = std::uint32_t;
  /// VTK order: 0-3 a ring, 4-7 above it.
  using Hex = std::array<Vertex, 8>;

  explicit ModelBuilder(std::string channel) { mesh_.channel_names = {std::move(channel)}; }

  Vertex add_vertex(const Vec3& position, double value);
  void add_hex(const Hex& corners) { add_cell(CellKind::kHex, corners); }
  /// Corners in VTK order, right-handed.
  void add_cell(CellKind kind, std::span<const Vertex> corners);
  /// A hexahedron with a core. `share`: edge of the core by edge of the whole; `value`: the core's.
  void add_hex_with_core(const Hex& corners, double share, double value);
  /// A hexahedron with a column that ends in the face 4-7. Returns the column's end there, in the order of 4-7.
  std::array<Vertex, 4> add_hex_with_inset(const Hex& corners, double share, double depth, double value);

  const Vec3& position(Vertex vertex) const { return mesh_.positions[vertex]; }
  double value(Vertex vertex) const { return static_cast<double>(mesh_.channel_values[vertex]); }

  /// Maps `limit`, the bounding box of the limit as designed, to the box from the origin to `size_mm`.
  ControlMesh finish(const Box3& limit, const Vec3& size_mm) &&;

 private:
  Vec3 inside(const Hex& corners, const Vec3& uvw) const;
  /// The hexahedron in the middle of a core or an inset, from height `bottom` to `top` of the whole's 1.
  Hex add_column(const Hex& corners, double share, double bottom, double top, double value);
  /// The first `count` of the cells between a whole hexahedron and its column.
  void add_round(const Hex& corners, const Hex& column, std::size_t count);

  ControlMesh mesh_;
};

}  // namespace ccslice
