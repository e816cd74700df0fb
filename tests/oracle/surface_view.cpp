// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/surface_view.h"

#include <algorithm>

namespace ccslice::oracle {
namespace {

BruteMesh hexes_only(const BruteMesh& mesh, const BruteTopology& topology) {
  const bool hexes = std::ranges::all_of(mesh.cells, [](const BruteCell& c) { return c.kind == CellKind::kHex; });
  return hexes ? mesh : refine(mesh, topology).mesh;
}

}  // namespace

SurfaceView::SurfaceView(const Subject& subject)
    : subject_(subject),
      mesh_(hexes_only(subject.brute(), subject.topology())),
      surface_(mesh_, build_topology(mesh_.cells, mesh_.vertex_count())) {}

CellParam SurfaceView::param(std::uint32_t face, double s, double t) const {
  const BfrSurface::Face& f = surface_.faces()[face];
  return subject_.locate_in_any(mesh_.cells[f.cell].from, BfrSurface::uvw(f, s, t));
}

}  // namespace ccslice::oracle
