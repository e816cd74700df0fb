// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes of voxels, and cells that a threshold left of a mesh, touch themselves in edges and in vertices, where no
// solid is subdivided. Each side gets vertices of its own there, at the same places, as parts have that abut.
//
// The link of a vertex (link_groups.h) shows what its cells are. A solid's links are discs or spheres.
//
// - Cells that no chain of faces at the vertex joins become different FANS, each with a copy of the vertex. An edge is
//   parted with one of its vertices.
// - Where one fan alone is neither a disc nor a sphere, as between two cavities that touch in an edge, it is cut into
//   discs, through the fewest faces between cells that are found. Such a face is parted at this vertex only.
//
// Cutting a face changes the links of its other vertices, so these are looked at again. A vertex with one cell is in
// order, and no face is cut twice, so this ends.

#pragma once

#include <cstddef>

#include "core/base/cancellation.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

struct SplitReport {
  std::size_t edges = 0;      // Where the mesh touched itself.
  std::size_t vertices = 0;   // Likewise, at the end of no such edge.
  Vec3 first = Vec3::Zero();  // The middle of the first edge, or else the first vertex, mm.
  std::size_t faces = 0;      // Between cells, that were parted at a vertex.
  std::size_t new_vertices = 0;
};

/// Splits the mesh where it touches itself. Sharp edges and vertices, region values, missed vertices, mid-nodes and
/// numbers.vertices go along: copies have what their vertex has. The first of a vertex's copies keeps its number,
/// further ones follow after all vertices. Throws Error (1xx) as validate() does before it comes to edges, or
/// kCancelled; the mesh is as it was then.
SplitReport split_touching(ControlMesh& mesh, FileNumbers& numbers, const CancellationToken& cancel = {});

}  // namespace ccslice
