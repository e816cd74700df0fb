// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The boundary of the limit volume: the Catmull-Clark surface of the boundary faces [Luu19, 3.1].
//
// Every boundary face of a limit-ready cell has a frame (s,t) in [0,1]^2, oriented so that dS/ds x dS/dt points out of
// the solid, with its irregular surface vertex, if any, at (0,0). A regular face is one bicubic patch. An irregular
// face is tiled by regular patches over dyadic sub-boxes: three a level ((1,0), (0,1), (1,1) of the box that remains at
// the origin), as deep as the caller wants; what remains at the origin shrinks geometrically.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/ids.h"
#include "core/base/types.h"
#include "core/limit/boundary_face.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// x, y, z, 0: one register.
using PaddedPoint = Eigen::Vector4d;

/// Control net of a bicubic Bezier patch: b[4 * row + column], column along s, row along t. mm, mesh frame.
struct BezierPatch {
  std::array<PaddedPoint, 16> b;
};

/// The part of an irregular face that remains at its origin: the box [0, 2^-level]^2 of the face's frame.
struct IrregularCorner {
  std::uint32_t op = 0;
  int level = 0;
  std::vector<PaddedPoint> ring;   // Control points of its one-ring: the surface that remains lies in their hull.
  std::vector<PaddedPoint> spare;  // Reused memory.
};

class BoundarySurface {
 public:
  explicit BoundarySurface(const LimitSolid& solid) : data_(&solid.data()) {}
  /// For a solid in the making. REQUIRES: its faces are there.
  explicit BoundarySurface(const LimitSolid::Data& data) : data_(&data) {}

  std::span<const BoundaryFace> faces() const noexcept;
  IdRange<BoundaryFaceId> face_ids() const noexcept { return IdRange<BoundaryFaceId>{faces().size()}; }
  /// The same, then the interfaces of cell regions, each once, as the region of the lower number has it. All below
  /// takes faces of either kind.
  std::span<const BoundaryFace> faces_and_interfaces() const noexcept;
  IdRange<BoundaryFaceId> interface_ids() const noexcept;
  /// REQUIRES: faces_and_interfaces()[face].regular.
  BezierPatch regular_patch(BoundaryFaceId face) const noexcept;
  /// Control points whose convex hull holds the face's surface: their box.
  const Box3& hull_box(BoundaryFaceId face) const noexcept;
  /// REQUIRES: it isn't regular. Writes the whole face (level 0). Reuses the memory of `corner`.
  void irregular_corner(BoundaryFaceId face, IrregularCorner& corner) const;
  /// Splits off the three regular patches of the next level, over the boxes (in units of 2^-(level+1)) at (1,0), (0,1)
  /// and (1,1), and leaves in `corner` what remains. A ring that was mapped affinely gives patches mapped alike.
  void split(IrregularCorner& corner, std::array<BezierPatch, 3>& patches) const;
  /// The limit position of the irregular vertex at the face's origin.
  Vec3 corner_position(const IrregularCorner& corner) const noexcept;

  /// The key of the dyadic place (s,t), fixed point, of a face: on sides and corners the shared key.
  SurfaceKey key(BoundaryFaceId face, std::uint32_t s, std::uint32_t t) const noexcept;
  /// (s,t) of a face -> (u,v,w) of its cell. s, t in [0,1].
  CellParam cell_param(BoundaryFaceId face, double s, double t) const noexcept;

 private:
  const LimitSolid::Data* data_;
};

}  // namespace ccslice
