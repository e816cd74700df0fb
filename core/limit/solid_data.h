// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What a LimitSolid keeps: control points of all refinement levels, one-rings of the limit-ready cells and boundary
// faces as indices into them, shared operators, and an index over the cells' bounding boxes. Private to core/limit.

#pragma once

#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/limit/boundary_surface.h"
#include "core/limit/box_tree.h"
#include "core/limit/cell_hulls.h"
#include "core/limit/limit_solid.h"
#include "core/subdivision/frame.h"
#include "core/subdivision/operators.h"

namespace ccslice {

/// A limit-ready cell. Its ring: 64 points (regular), 4 layers (line), or the numbered ring (vertex).
struct LimitCell {
  CellClass cell_class = CellClass::kRegular;
  std::uint8_t boundary_sides = 0;  // Bit s: side s (BoundaryFace::cell_side) is a face of the boundary.
  PhantomMask phantoms = 0;
  Frame frame;
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;
  std::uint32_t ring_count = 0;
  std::uint32_t control_cell = 0;
};

struct SurfaceFaceRing {
  PhantomMask phantoms = 0;
  std::uint32_t op = kNone;
  std::uint32_t ring_begin = 0;
  std::uint32_t ring_count = 0;
};

/// A first guess of the parameters of a point near a cell, to first order about the cell's middle.
struct CellMap {
  Vec3 middle = Vec3::Zero();            // geo(1/2, 1/2, 1/2), mm.
  Mat3 inverse_jacobian = Mat3::Zero();  // There; zero where it has none.
  Box3 hull;                             // Holds the guesses for all points of the cell: a sheared box around it.

  Vec3 operator()(const Vec3& point) const { return Vec3::Constant(0.5) + inverse_jacobian * (point - middle); }
  /// About, and at most, its least extent; infinite where there is no Jacobian.
  double thickness_mm() const { return 1 / inverse_jacobian.norm(); }
  /// The cell may come as near as that to the point that was guessed.
  bool may_hold(const Vec3& guess, double distance_mm) const {
    const Vec3 margin = distance_mm * inverse_jacobian.cwiseAbs().rowwise().sum() + kRounding * hull.diagonal();
    return ((guess - hull.min() + margin).array() >= 0).all() && ((hull.max() - guess + margin).array() >= 0).all();
  }

 private:
  static constexpr double kRounding = 1e-9;
};

/// About, by the Jacobians in the middle of cells; infinite where there is none. mm^3.
struct CellVolumes {
  double least = std::numeric_limits<double>::infinity(), most = 0;
};

struct LimitSolid::Data {
  std::size_t dimension = 3;   // 3 + channels.
  std::vector<double> points;  // dimension doubles a control point: x, y, z (mm), channels.
  std::vector<std::uint32_t> rings;
  std::vector<LimitCell> cells;
  OperatorTable operators;
  std::vector<BoundaryFace> faces;
  std::vector<SurfaceFaceRing> face_rings;
  std::vector<Box3> face_hulls;  // Boxes of the rings' points.
  std::vector<CellMap> cell_maps;
  CellVolumes regular_volumes, irregular_volumes;
  BoxTree cell_boxes;                     // Bounding boxes of the cells' limits, mesh frame.
  BoxTree fold_boxes;                     // Of the cells that fold, or may fold.
  std::vector<std::uint32_t> fold_cells;  // Those cells, ascending.
  CellHulls hulls_near_folds;             // Of the cells whose boxes meet theirs.
  BoxTree overlap_boxes;                  // Of the cells that may overlap a separate part of the solid.
  std::vector<std::uint32_t> parts;       // By cell: its part, numbered by first cells. Empty if no parts overlap.
  SolidSummary summary;

  std::span<const std::uint32_t> ring(const LimitCell& cell) const {
    return std::span(rings).subspan(cell.ring_begin, cell.ring_count);
  }
  std::span<const std::uint32_t> ring(const SurfaceFaceRing& face) const {
    return std::span(rings).subspan(face.ring_begin, face.ring_count);
  }
  /// The solid may fold in this box, or separate parts of it may overlap there: a point may have several parameters.
  bool is_ambiguous(const Box3& box) const noexcept {
    const auto any = [](std::uint32_t) { return true; };
    return fold_boxes.any_meeting(box, any) || overlap_boxes.any_meeting(box, any);
  }
  double volume_mm3(std::uint32_t cell) const { return 1 / std::abs(cell_maps[cell].inverse_jacobian.determinant()); }
  const double* point(std::uint32_t id) const { return points.data() + id * dimension; }
  Vec3 position(std::uint32_t id) const { return Vec3::Map(point(id)); }
};

}  // namespace ccslice
