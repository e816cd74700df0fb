// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far the limit volume is from its control mesh. Subdivision rounds edges that aren't sharp and draws convex shapes
// inwards, so what is printed isn't what was drawn: these figures say by how much.
//
// VOLUME. By the divergence theorem it is the integral of z dx dy over the boundary. The control mesh's boundary faces
// are triangles, and quadrilaterals, which count as bilinear. Over a bicubic patch the integrand is a polynomial of
// degree 8 along s and t: 5 x 5 Gauss points integrate it exactly. Irregular faces are nests of such patches
// (boundary_surface.h), integrated down to kVolumeLevels levels. What remains at the origin is replaced by the cone
// from the irregular vertex's limit point over the two outer sides of what remains. A cone shares its other sides with
// those beside it, so the surface stays closed, and only the sliver between the cone and the limit is missing. On all
// tiny meshes and samples that is less than 2e-6 of the volume, and nothing where all faces are regular. A place that
// the solid covers twice counts twice, one that is turned inside out counts as negative. Inverted control cells on the
// boundary may face inwards there, beside others that face outwards: no volume is well-defined then, and the figures
// are rough.
//
// VERTICES. Each control point of the boundary has a point of the limit surface of its own, where subdivision takes it
// in the end. On a sharp vertex they are the same. Vertices on interfaces of cell regions don't count
// unless they are on the boundary, too: the figures are about the outside.
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

namespace ccslice {

/// Levels of patches that are integrated towards an irregular vertex.
inline constexpr int kVolumeLevels = 6;

/// Volume within the limit surface, mm^3; the same for any number of threads. Irregular faces are integrated down to
/// `levels` levels, at least 1. Takes about half a microsecond for a regular face and ten for an irregular one, a
/// twentieth of what preparing the samples takes, and less where there are many cells inside. Throws Error{kCancelled}.
double limit_volume_mm3(const BoundarySurface& surface, int levels = kVolumeLevels, int threads = 1,
                        const CancellationToken& cancel = {});

/// The boundary vertex that is farthest from its limit point once both are mapped: max |map * (limit - position)|. The
/// lowest id where several are. `map` may count in voxels. REQUIRES: a solid, which has boundary vertices.
VertexLimit farthest_vertex(const LimitSolid& solid, const Mat3& map);

/// The figures of placement * solid, world frame; edges turn by what they turn by in the mesh frame.
Deviation placed_deviation(const LimitSolid& solid, const Placement& placement);

/// What a solid is like from outside.
struct LimitShape {
  Box3 bounding_box;  // Box of the limit volume, mesh frame, mm.
  Deviation deviation;
  std::vector<CellRegionSummary> cell_regions;
};

/// What LimitSolid::prepare() says of the limit's shape (SolidSummary), without preparing it for slicing, in about half
/// of the time. Throws what prepare() does.
LimitShape measure_limit(ControlMesh mesh, const PrepareOptions& options = {});

}  // namespace ccslice
