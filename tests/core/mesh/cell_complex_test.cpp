// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/mesh/cell_complex.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(CellComplex, CountsItemsOfABox) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(3, 2, 2));
  EXPECT_EQ(complex.vertex_count(), 4u * 3 * 3);
  EXPECT_EQ(complex.cell_count(), 12u);
  EXPECT_EQ(complex.face_count(), 4u * 2 * 2 + 3 * 3 * 2 + 3 * 2 * 3);
  EXPECT_EQ(complex.edge_count(), 3u * 3 * 3 + 4 * 2 * 3 + 4 * 3 * 2);
}

TEST(CellComplex, SatisfiesEulersFormulaOnTheCatalogue) {
  // Characteristic 1 for a ball, 2 for a ball with a cavity, 0 for a ring.
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const CellComplex complex = make_cell_complex(mesh);
    const auto n = [](std::size_t x) { return static_cast<long>(x); };
    const long characteristic =
        n(complex.vertex_count()) - n(complex.edge_count()) + n(complex.face_count()) - n(complex.cell_count());
    EXPECT_GE(characteristic, 0) << name;
    EXPECT_LE(characteristic, 2) << name;
  }
}

TEST(CellComplex, PairsHalfFacesAndMarksTheBoundary) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(2, 1, 1));
  int inside = 0;
  for (const CellId c : complex.cells()) {
    const auto half_faces = complex.cell_half_faces(c);
    for (std::uint8_t side = 0; side < 6; ++side) {
      EXPECT_EQ(complex.half_face_cell(half_faces[side]), c);
      EXPECT_EQ(complex.half_face_local(half_faces[side]), side);
      const CellId other = complex.half_face_cell(opposite(half_faces[side]));
      EXPECT_EQ(complex.face_on_boundary(face_of(half_faces[side])), other == kNone);
      inside += other != kNone;
    }
  }
  EXPECT_EQ(inside, 2);
}

TEST(CellComplex, ListsFacesCounterClockwiseFromOutside) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const CellComplex complex = make_cell_complex(mesh);
    for (const FaceId f : complex.faces()) {
      const auto ring = complex.face_vertices(f);
      const auto cell = complex.cell_vertices(complex.half_face_cell(half_faces_of(f)[0]));
      Vec3 inside = Vec3::Zero();
      for (const std::uint32_t v : cell) inside += mesh.positions[v] / static_cast<double>(cell.size());
      const Vec3& p = mesh.positions[ring[0]];
      const Vec3 normal = (mesh.positions[ring[1]] - p).cross(mesh.positions[ring[2]] - p);
      EXPECT_LT(normal.dot(inside - p), 0) << name << " face " << f;
    }
  }
}

TEST(CellComplex, RoundEdgesAndVerticesHoldWhatTouchesThem) {
  const ControlMesh mesh = oracle::box_mesh(2, 2, 2, 1);
  const CellComplex complex = make_cell_complex(mesh);
  const auto at = std::find(mesh.positions.begin(), mesh.positions.end(), Vec3(1, 1, 1));
  const VertexId centre{static_cast<std::uint32_t>(at - mesh.positions.begin())};
  EXPECT_FALSE(complex.vertex_on_boundary(centre));
  EXPECT_EQ(complex.vertex_cells(centre).size(), 8u);
  EXPECT_EQ(complex.vertex_faces(centre).size(), 12u);
  EXPECT_EQ(complex.vertex_edges(centre).size(), 6u);
  for (const EdgeId e : complex.vertex_edges(centre)) {
    EXPECT_EQ(complex.edge_cells(e).size(), 4u);
    EXPECT_EQ(complex.edge_faces(e).size(), 4u);
    EXPECT_EQ(complex.find_edge(complex.edge_other(e, centre), centre), e);
  }
  EXPECT_EQ(complex.find_edge(centre, centre), kNone);
}

TEST(CellComplex, RefusesAFaceInThreeCells) {
  std::vector<VertexId> corners;
  for (int i = 0; i < 3; ++i) {
    for (std::uint32_t j = 0; j < 4; ++j) corners.emplace_back(j);
    for (std::uint32_t j = 0; j < 4; ++j) corners.emplace_back(4 + 4 * i + j);
  }
  try {
    const CellComplex complex(16, std::vector<CellKind>(3, CellKind::kHex), corners, {}, {});
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kMeshNonManifoldFace);
    EXPECT_EQ(error.ids(), (std::vector<std::int64_t>{0, 1, 2}));
  }
}

}  // namespace
}  // namespace ccslice
