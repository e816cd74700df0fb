// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pieces of boundary faces, and boxes around them that lie as they do: of two faces side by side the boxes are flat and
// apart, however the faces lie in space.
//
// Private to core/limit.

#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/limit/boundary_surface.h"

namespace ccslice {

/// A box around a piece of the surface, along the axes and along the piece.
struct SlantedBox {
  Box3 box;                      // Mesh frame.
  Mat3 axes = Mat3::Identity();  // Rows: along s, across it, and out of the solid.
  Vec3 low = box.min(), high = box.max();
  bool has_normal = false;  // Without one it is a box along the axes.

  /// The box that lies as a piece with these corners does, in their order round it.
  static SlantedBox around(std::span<const PaddedPoint> points, const std::array<Vec3, 4>& corners);
};

/// The surfaces of two pieces don't cross: the pieces are apart, or one is on the outer side of the other by their
/// boxes, or on its inner side as a whole. On the outer side a piece may reach in by `least_mm`; on the inner side it
/// is deeper than that.
bool cannot_cross(const SlantedBox& a, const SlantedBox& b, double least_mm);

struct SurfacePiece {
  std::array<PaddedPoint, 16> net;  // Bezier; of no use at an irregular vertex.
  std::array<Vec3, 4> corners;      // (0,0), (1,0), (1,1), (0,1).
  SlantedBox box;
  bool is_rest = false;  // At the irregular vertex of its face.
};

/// A face and pieces of it, quartered where it is asked for. Reuses its memory. One thread.
class SurfacePieces {
 public:
  explicit SurfacePieces(const BoundarySurface& surface) : surface_(surface) {}

  /// A box around a face, whatever is quartered here.
  SlantedBox box_of(BoundaryFaceId face);

  /// Forgets all pieces but one or four that make up this face.
  void start(BoundaryFaceId face);
  /// Forgets all pieces, and frees their memory.
  void clear() { pieces_ = {}, quarters_ = {}, roots_ = 0; }
  /// How many make up the face: they come first.
  std::uint32_t roots() const { return roots_; }
  std::uint32_t size() const { return static_cast<std::uint32_t>(pieces_.size()); }
  const SurfacePiece& operator[](std::uint32_t piece) const { return pieces_[piece]; }
  /// The first of a piece's four quarters. Moves all pieces.
  std::uint32_t quarters(std::uint32_t piece);

 private:
  void append(const std::array<PaddedPoint, 16>& net);
  /// Three patches, and what is left of `corner_`.
  void append_split();

  const BoundarySurface& surface_;
  IrregularCorner corner_, boxed_corner_;
  std::array<BezierPatch, 3> patches_;
  std::vector<PaddedPoint> points_;
  std::vector<SurfacePiece> pieces_;
  std::uint32_t roots_ = 0;
  std::vector<std::uint32_t> quarters_;  // By piece: the first of its quarters, or kNone.
};

}  // namespace ccslice
