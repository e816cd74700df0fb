// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Regions of cells with sharp interfaces between them.
//
// Each region is a Catmull-Clark solid of its own: its boundary are faces of the mesh's boundary and INTERFACES, the
// faces between cells of different regions. So the mesh is split along its interfaces, where every region gets
// vertices of its own, at the same places. The limit of an interface is the Catmull-Clark surface of the interface's
// faces, seen from either side, because the rules of a boundary ask for faces of that boundary only. That takes that
// both sides see the same faces round a vertex, or the same sharp features. It holds in the middle of an interface; its
// rim, where it meets the boundary or other interfaces, is made sharp:
//
// - An edge with three or more faces of boundary or interface (a JUNCTION) is sharp in every region there. So its limit
//   is a curve of the junction's own vertices.
// - A vertex on interfaces stays where it is, in every region, if three or more sharp edges meet there, or if some
//   region has only some of those that do.
//
// Channels are continuous across an interface where both copies of a vertex have the same values, and jump where they
// have values of their own (core/mesh/region_values.h).
//
// Cells keep their numbers. The first of a vertex's copies keeps the vertex's number, further ones follow after all
// vertices.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/ids.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

/// What lies beyond a face that is no interface.
inline constexpr std::uint8_t kNoCellRegion = 0xff;

/// A face of a cell that is also one of a cell of another region.
struct InterfaceSide {
  CellId cell;
  std::uint8_t side = 0;    // The face's number in the cell.
  std::uint8_t beyond = 0;  // The other cell's region.
};

struct SplitMesh {
  ControlMesh mesh;                       // Without region_values, which its copies of vertices have.
  std::vector<std::uint32_t> origins;     // By vertex: which of the given mesh it is a copy of.
  std::vector<InterfaceSide> interfaces;  // By cell, then by side; each interface is here twice.
};

/// More than one region has cells.
bool has_several_regions(const ControlMesh& mesh);

/// The region of a cell, 0 in a mesh without names of regions.
inline std::uint8_t region_of(const ControlMesh& mesh, CellId cell) {
  return mesh.cell_regions.empty() ? std::uint8_t{0} : mesh.cell_regions[cell];
}

/// Cells of different regions meet at the edge.
bool edge_on_interface(const ControlMesh& mesh, const CellComplex& complex, EdgeId edge);
/// Cells of different regions meet at the vertex.
bool vertex_on_interface(const ControlMesh& mesh, const CellComplex& complex, VertexId vertex);

/// REQUIRES: `complex` is the validated mesh's. Throws Error{kMeshNonManifoldRegion} if the cells of one region at a
/// vertex don't form half-balls that have only the vertex in common, and Error{kCancelled}.
SplitMesh split_cell_regions(const ControlMesh& mesh, const CellComplex& complex, const CancellationToken& cancel = {});

/// Gives the mesh the positions and channels of the copies of its split mesh: of the first copies, and of each region
/// where it has region_values. REQUIRES: `copies` has the cells of split.mesh.
void take_from_copies(const SplitMesh& split, const ControlMesh& copies, ControlMesh& mesh);

}  // namespace ccslice
