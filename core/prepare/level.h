// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A level of refinement, whole or a cut-out of it: a complex, which control points its vertices are, and what its
// places are called on the surface. Names are found from the level above, as only the boundary needs them.
//
// Private to core/limit.

#pragma once

#include <cstdint>
#include <vector>

#include "core/limit/boundary_face.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/cell_regions.h"
#include "core/subdivision/refine.h"

namespace ccslice {

/// What a level has in common with all of its cut-outs. Vertices have the numbers that they have among all of the
/// level.
struct LevelNames {
  std::uint32_t point_base = 0;           // The control point of vertex 0.
  const struct Level* parent = nullptr;   // Nothing for the control mesh, likewise
  const ChildOrigins* origins = nullptr;  // of its vertices.
  // The names of new vertices and edges of the surface begin here.
  std::uint32_t first_vertex = 0, first_edge = 0;
};

struct Level {
  CellComplex complex;
  const LevelNames* names;
  std::vector<VertexId> numbers{};  // By vertex, ascending: its number among all of the level. Empty: the same.
  // Of a control mesh of several regions, else empty:
  std::vector<std::uint32_t> originals{};      // By vertex: the one that it is a copy of.
  std::vector<FaceSide> edge_roots{};          // By edge: from its first vertex to its second.
  std::vector<std::uint8_t> regions_beyond{};  // By face.

  VertexId number(VertexId vertex) const { return numbers.empty() ? vertex : numbers[vertex]; }
  std::uint32_t point(VertexId vertex) const { return names->point_base + number(vertex); }
  /// REQUIRES: it is here.
  VertexId vertex_of_point(std::uint32_t point) const;

  // Of the boundary. REQUIRES: quads, but for edges of the control mesh.
  SurfaceKey vertex_key(VertexId vertex) const;
  /// The side of a face.
  FaceSide side(VertexId from, VertexId to) const;
  /// The region beyond an interface, or kNoCellRegion.
  std::uint8_t beyond(FaceId face) const;

 private:
  FaceSide root_of(EdgeId edge) const;
  FaceSide side_of_child(VertexId low, VertexId high) const;
};

}  // namespace ccslice
