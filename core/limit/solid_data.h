// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a LimitSolid keeps: control points of all refinement levels, one-rings of the limit-ready cells and boundary
// faces as indices into them, shared operators, and the index of cells and their bricks, which alone are for all
// (LimitSolid::index(), bricks()). Private to core/limit and to the sampling of blocks
// (interpolation/samples/cell_block.h, interpolation/samples/brick_blocks.h).

#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/limit/boundary_face.h"
#include "core/limit/cell_bricks.h"
#include "core/limit/cell_index.h"
#include "core/limit/limit_solid.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/operator_table.h"

namespace ccslice {

/// A limit-ready cell. Its ring: 64 points (regular), 4 layers (line), or what the vertex's star lacks (vertex), picked
/// from those of a family of cells that have most in common.
struct LimitCell {
  CellClass cell_class = CellClass::kRegular;
  std::uint8_t boundary_sides = 0;   // Bit s: side s (BoundaryFace::cell_side) is a face of the boundary.
  std::uint8_t interface_sides = 0;  // Bit s: side s is between two cell regions.
  PhantomMask phantoms = 0;
  Frame frame;
  std::uint16_t boundary_edges = 0;  // Bit e: edge e of a hexahedron (mesh/cell_kind.h) has a face of the boundary.
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;  // The family's points,
  std::uint32_t ring_order = 0;  // and where its own ones stand among them.
  std::uint32_t star_begin = 0;  // Vertex cells: the points of the star, shared by the cells at the vertex.
  ControlCellId control_cell;
};

struct SurfaceFaceRing {
  PhantomMask phantoms = 0;
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;
  std::uint32_t ring_count = 0;
};

/// The points of a cell's ring.
class CellRing {
 public:
  CellRing(const std::uint32_t* family, std::span<const std::uint32_t> order) : family_(family), order_(order) {}

  std::size_t size() const { return order_.size(); }
  std::uint32_t operator[](std::size_t n) const { return family_[order_[n]]; }

 private:
  const std::uint32_t* family_;
  std::span<const std::uint32_t> order_;
};

/// Vertices of the control mesh with a point of the limit surface of their own.
struct VertexLimits {
  std::vector<std::uint32_t> ids;  // Ascending. Their points come first in LimitSolid::Data::points.
  std::vector<Vec3> limits;        // Their limit points, mm.
  std::vector<Vec3> meant;         // If a fit missed any: LimitSolid::Data::meant_position().

  /// Which of them it is.
  std::optional<std::size_t> find(std::uint32_t vertex) const {
    const auto found = std::ranges::lower_bound(ids, vertex);
    if (found == ids.end() || *found != vertex) return std::nullopt;
    return static_cast<std::size_t>(found - ids.begin());
  }
};

struct LimitSolid::Data : CellIndex {
  std::size_t dimension = 3;               // 3 + channels.
  std::vector<double> points;              // dimension doubles a control point: x, y, z (mm), channels.
  std::vector<std::uint32_t> rings;        // Of families of cells, of stars and of faces.
  std::vector<std::uint32_t> ring_orders;  // Shared by cells with rings that are alike.
  std::vector<LimitCell> cells;
  CellBricks bricks;
  OperatorTable operators;
  std::vector<BoundaryFace> faces;  // Of the boundary, then of interfaces.
  std::uint32_t boundary_face_count = 0;
  std::vector<SurfaceFaceRing> face_rings;
  std::vector<Box3> face_hulls;                // Boxes of the rings' points.
  std::vector<std::uint8_t> cell_regions;      // By control cell, as in the control mesh.
  std::vector<std::uint32_t> control_corners;  // Vertices of the control cells, one cell after the other,
  std::vector<std::uint32_t> first_corners;    // and where they begin. And the end.
  bool has_several_regions = false;            // More than one has cells.
  VertexLimits boundary_vertices;
  VertexLimits interface_vertices;  // Those that aren't on the boundary.
  SolidSummary summary;

  std::uint32_t ring_count(const LimitCell& cell) const {
    switch (cell.cell_class) {
      case CellClass::kLine: return 4 * operators.lines()[cell.op].points;
      case CellClass::kVertex: return operators.corners()[operators.vertices()[cell.op].corner].own;
      default: return 64;
    }
  }
  CellRing ring(const LimitCell& cell) const {
    return {rings.data() + cell.ring_begin, std::span(ring_orders).subspan(cell.ring_order, ring_count(cell))};
  }
  std::span<const std::uint32_t> ring(const SurfaceFaceRing& face) const {
    return std::span(rings).subspan(face.ring_begin, face.ring_count);
  }
  /// The points of a vertex cell's star.
  std::span<const std::uint32_t> star(const LimitCell& cell) const {
    return std::span(rings).subspan(cell.star_begin, operators.stars()[operators.vertices()[cell.op].star].points);
  }
  /// Points that an irregular cell's limit depends on: a vertex cell's star comes before its ring.
  std::size_t point_count(const LimitCell& cell) const {
    return (cell.cell_class == CellClass::kVertex ? star(cell).size() : 0) + ring_count(cell);
  }
  /// Calls visit(n, id) for the n-th of them; kNone in phantom layers.
  template <typename Visit>
  void for_each_point(const LimitCell& cell, Visit visit) const {
    std::size_t n = 0;
    if (cell.cell_class == CellClass::kVertex) {
      for (const std::uint32_t id : star(cell)) visit(n++, id);
    }
    const CellRing own = ring(cell);
    for (std::size_t i = 0; i < own.size(); ++i) visit(n++, own[i]);
  }
  std::span<const std::uint32_t> corners(ControlCellId cell) const {
    return std::span(control_corners).subspan(first_corners[cell], first_corners[cell + 1] - first_corners[cell]);
  }
  const double* point(std::uint32_t id) const { return points.data() + id * dimension; }
  Vec3 position(std::uint32_t id) const { return Vec3::Map(point(id)); }
  /// Where the n-th of these vertices is meant to be: in an interpolating mesh at its limit point, unless the fit
  /// missed it.
  Vec3 meant_position(const VertexLimits& vertices, std::size_t n) const {
    if (!vertices.meant.empty()) return vertices.meant[n];
    return summary.deviation.interpolating ? vertices.limits[n] : position(vertices.ids[n]);
  }
};

}  // namespace ccslice
