// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Two oracles against each other: the boundary of the brute-force volume and OpenSubdiv's surface.

#include "tests/support/bfr_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

double diagonal(const BruteMesh& mesh) {
  Box3 box;
  for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) box.extend(mesh.position(v));
  return box.diagonal().norm();
}

class BfrAgainstBruteForce : public testing::TestWithParam<std::size_t> {};

TEST_P(BfrAgainstBruteForce, AgreeOnTheBoundaryLimit) {
  const TinyMesh& tiny = tiny_meshes()[GetParam()];
  BruteMesh mesh = to_brute_mesh(tiny.mesh);
  BruteTopology topology = build_topology(mesh.cells, mesh.vertex_count());
  if (std::ranges::any_of(mesh.cells, [](const BruteCell& c) { return c.kind != CellKind::kHex; })) {
    mesh = refine(mesh, topology).mesh;
    topology = build_topology(mesh.cells, mesh.vertex_count());
    for (BruteCell& cell : mesh.cells) cell.from = {};
  }
  const BfrSurface surface(mesh, topology);
  for (std::uint32_t c = 0; c < mesh.cells.size(); ++c) mesh.cells[c].from.control_cell = c;
  std::map<std::pair<std::uint32_t, int>, std::uint32_t> face_of;
  for (std::uint32_t f = 0; f < surface.faces().size(); ++f)
    face_of[{surface.faces()[f].cell, surface.faces()[f].local}] = f;
  const double tolerance = 1e-6 * diagonal(mesh);
  for (int k = 0; k < 2; ++k) {
    mesh = refine(mesh, topology).mesh;
    topology = build_topology(mesh.cells, mesh.vertex_count());
  }
  double worst = 0;
  for (const BruteFace& fine : topology.faces) {
    if (!fine.boundary) continue;
    const BruteCell& cell = mesh.cells[fine.cells[0]];
    const std::uint32_t face = face_of.at({cell.from.control_cell, fine.first_local});
    for (int i = 0; i < 4; ++i) {
      const int corner = tables(CellKind::kHex).faces[fine.first_local][i];
      if (!has_limit_mask(mesh, topology, cell.v[corner])) continue;  // Ends of creases: Bfr approximates there.
      const int bits = kCornerBits[corner];
      Vec3 uvw;
      for (int d = 0; d < 3; ++d) uvw[d] = std::ldexp(cell.from.ijk[d] + (bits >> d & 1), -cell.from.level);
      const Vec3 origin = BfrSurface::uvw(surface.faces()[face], 0, 0);
      const Vec3 s_axis = BfrSurface::uvw(surface.faces()[face], 1, 0) - origin;
      const Vec3 t_axis = BfrSurface::uvw(surface.faces()[face], 0, 1) - origin;
      const Vec3 p = surface.position(face, (uvw - origin).dot(s_axis), (uvw - origin).dot(t_axis));
      const Vec3 q = limit_point(mesh, topology, cell.v[corner]).head<3>();
      worst = std::max(worst, (p - q).norm());
    }
  }
  EXPECT_LT(worst, tolerance) << tiny.name;
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, BfrAgainstBruteForce, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

TEST(NearestOnSurface, FindsTheDistanceToAFlatSide) {
  ControlMesh box = box_mesh(3, 3, 3);
  sharpen_by_cells(box, 1);
  const BruteMesh mesh = to_brute_mesh(box);
  const BfrSurface surface(mesh, build_topology(mesh.cells, mesh.vertex_count()));
  const NearestOnSurface nearest(surface, 6);
  EXPECT_NEAR(nearest.distance({13.3, 17.7, 30.25}), 0.25, 1e-9);
  EXPECT_NEAR(nearest.distance({0.1, 7, 0.3}), 0.1, 1e-9);
  EXPECT_NEAR(nearest.distance({30.3, 30.4, 12}), 0.5, 1e-6);
}

}  // namespace
}  // namespace ccslice::oracle
