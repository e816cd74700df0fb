// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The one-rings of boundary faces on the Catmull-Clark surface that bounds the solid, in canonical order (see ring.h).
//
// Only what lies between sharp edges shapes a face. A corner of a face is regular if
//   - no sharp edge meets there, the vertex isn't tagged, and the surface valence is 4;
//   - exactly two sharp edges meet (a crease), it isn't tagged, and the face's side of the crease has two faces;
//   - it is fixed (three or more sharp edges, or tagged) and both sides of the face at it are sharp.
// A face with four regular corners is one bicubic B-spline patch, with a phantom layer across each sharp side. In a
// complex that is as meshed all faces are, with phantom layers across all sides: so they are bilinear.

#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/cell_complex.h"
#include "core/subdivision/ring.h"

namespace ccslice {

struct SurfaceRing {
  bool regular = true;
  std::uint8_t start = 0;        // The face's vertex (counter-clockwise from outside) at (s,t) = (0,0).
  PhantomMask phantoms = 0;      // Regular faces: sides s=0, s=1, t=0, t=1.
  std::vector<VertexId> points;  // Regular: 16, points[i + 4j], kNone in phantom layers. Else the numbered ring.
  std::vector<std::array<std::uint32_t, 4>> quads;        // Irregular: corner bits s + 2t; quads[0] is the face itself.
  std::vector<std::array<std::uint32_t, 2>> sharp_edges;  // Irregular: at the face's vertices.
  std::vector<std::uint32_t> sharp_vertices;
  std::vector<std::uint32_t> key;
};

class SurfaceWalker {
 public:
  explicit SurfaceWalker(const CellComplex& complex);

  /// The ring of a boundary face, with its irregular corner, if any, at the origin. REQUIRES: a quad whose vertices are
  /// complete. Throws Error{kInternal} if it has two irregular corners (its cell wasn't limit-ready).
  SurfaceRing walk(FaceId face);
  /// The ring of a boundary face, but with the face's vertex `start` at the origin whatever is irregular.
  SurfaceRing irregular_ring(FaceId face, std::uint8_t start);

 private:
  struct Framed {
    FaceId face;
    std::array<VertexId, 4> vertices;  // By corner bits s + 2t.
  };
  Framed framed(FaceId face, std::uint8_t start) const;
  EdgeId side_edge(const Framed& at, unsigned axis, unsigned side) const;
  Framed cross(const Framed& from, unsigned axis, unsigned side) const;
  FaceId other_face(EdgeId edge, FaceId face) const;
  bool corner_regular(FaceId face, unsigned corner) const;
  SurfaceRing regular_ring(FaceId face) const;

  const CellComplex& complex_;
  std::vector<std::uint32_t> local_;
};

}  // namespace ccslice
