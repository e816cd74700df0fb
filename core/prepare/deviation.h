// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far the limit volume is from its control mesh. Subdivision rounds edges that aren't sharp and draws convex shapes
// inwards, so what is printed isn't what was drawn: these figures say by how much.
//
// VOLUME. Between the boundary faces of the control mesh, which are triangles, and quadrilaterals, which count as
// bilinear; and within the limit surface (limit_volume.h). A place that the solid covers twice counts twice, one that
// is turned inside out counts as negative. Inverted control cells on the boundary may face inwards there, beside others
// that face outwards: no volume is well-defined then, and the figures are rough. A cell region has volumes of its own,
// as interfaces move like the boundary does.
//
// VERTICES. Each control point of the boundary, or of an interface, has a point of the limit surface of its own, where
// subdivision takes it in the end. On a sharp vertex they are the same.
//
// INTERPOLATING meshes (ControlMesh::interpolating) mean the mesh of these limit points, and that is what the limit is
// compared with: its volume, its box; no vertex is away from its limit point. But vertices that the fit missed are
// meant to be where it was to take them (ControlMesh::missed_vertices). Between its vertices that mesh is flat, and the
// limit is not: a round part holds more than its flat faces, and no fault is in that. It is one where edges were
// rounded that should be sharp (mesh/rounded_edges.h).

#pragma once

#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/boundary_surface.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_options.h"

namespace ccslice {

/// The vertex of boundary or interfaces that is farthest from its limit point once both are mapped: max |map * (limit -
/// position)|. Where several are, the boundary goes first, then the lowest id. `map` may count in voxels.
VertexLimit farthest_vertex(const LimitSolid& solid, const Mat3& map);

/// The figures of placement * solid, world frame; edges turn by what they turn by in the mesh frame.
Deviation placed_deviation(const LimitSolid& solid, const Placement& placement);

/// What a solid is like from outside.
struct LimitShape {
  Box3 bounding_box;  // Box of the limit volume, mesh frame, mm.
  Deviation deviation;
  std::vector<CellRegionSummary> cell_regions;
};

/// What prepare_solid() says of the limit's shape (SolidSummary), without preparing it for slicing, in about half
/// of the time. Throws what prepare() does.
LimitShape measure_limit(ControlMesh mesh, const PrepareOptions& options = {});

}  // namespace ccslice
