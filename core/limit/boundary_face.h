// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Faces of the boundary, and the names of places on it.
//
// Dyadic places on the surface have exact integer keys, shared by all faces that meet there whatever their refinement
// level: contours are stitched by keys, never by comparing coordinates.

#pragma once

#include <array>
#include <compare>
#include <cstdint>

#include "core/base/ids.h"
#include "core/mesh/cell_regions.h"

namespace ccslice {

/// Fixed-point parameter: kSurfaceOne is 1.0. Dyadic fractions down to 2^-31 are exact.
inline constexpr std::uint32_t kSurfaceOne = 1u << 31;

/// Identity of a dyadic place on the surface. Equal keys <=> same place. Ordered, hashable by its three words.
struct SurfaceKey {
  enum class Kind : std::uint32_t { kVertex, kEdge, kFace };
  Kind kind = Kind::kVertex;
  std::uint32_t id = 0;  // Vertex, edge or face, by kind.
  std::uint32_t s = 0;   // kEdge: position along the root edge; kFace: s in the face's frame; else 0.
  std::uint32_t t = 0;   // kFace: t in the face's frame; else 0.
  friend auto operator<=>(const SurfaceKey&, const SurfaceKey&) = default;
};

/// A side of a face: a dyadic interval of an edge of the surface. t_begin may be larger than t_end.
struct FaceSide {
  std::uint32_t edge = 0;
  std::uint32_t t_begin = 0;
  std::uint32_t t_end = kSurfaceOne;
};

struct BoundaryFace {
  LimitCellId cell;
  std::uint8_t cell_side = 0;  // 2 * axis + (at 1), in the cell's frame: u=0, u=1, v=0, v=1, w=0, w=1.
  bool regular = true;
  std::array<SurfaceKey, 4> corners;        // At (0,0), (1,0), (1,1), (0,1).
  std::array<FaceSide, 4> sides;            // From corner i to corner (i+1) % 4.
  std::array<std::uint8_t, 4> cell_corner;  // Corner bits (u + 2v + 4w) of the cell's frame at the four corners.
  std::uint8_t region = 0;                  // The cell's.
  std::uint8_t beyond = kNoCellRegion;      // Of an interface: the region on its other side.
};

}  // namespace ccslice
