// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine.h"

#include <gtest/gtest.h>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

std::vector<CellId> all_cells(const CellComplex& complex) { return complex.cells().to_vector(); }

Vec3 apply_row(const Refinement& refined, std::uint32_t row, const std::vector<Vec3>& points) {
  Vec3 sum = Vec3::Zero();
  const Stencils& s = refined.stencils;
  for (std::uint32_t e = s.offsets[row]; e < s.offsets[row + 1]; ++e) sum += s.weights[e] * points[s.indices[e]];
  return sum;
}

TEST(Refine, RowsAreConvexCombinationsOnTheCatalogue) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const CellComplex complex = make_cell_complex(mesh);
    const Refinement refined = refine(complex, all_cells(complex));
    ASSERT_EQ(refined.stencils.rows(), refined.complex.vertex_count()) << name;
    for (std::uint32_t r = 0; r < refined.stencils.rows(); ++r) {
      double sum = 0;
      for (std::uint32_t e = refined.stencils.offsets[r]; e < refined.stencils.offsets[r + 1]; ++e) {
        EXPECT_GE(refined.stencils.weights[e], 0) << name << " row " << r;
        sum += refined.stencils.weights[e];
      }
      EXPECT_NEAR(sum, 1, 1e-14) << name << " row " << r;
    }
  }
}

TEST(Refine, GivesAsManyChildrenAsCornersInTheirOrder) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(2, 2, 1));
  const Refinement refined = refine(complex, all_cells(complex));
  ASSERT_EQ(refined.complex.cell_count(), 32u);
  for (const CellId c : complex.cells()) {
    ASSERT_EQ(refined.first_child[c], 8 * c);
    for (std::uint32_t corner = 0; corner < 8; ++corner) {
      // A child keeps the parent's axes, so its own corner of that number is the parent's vertex.
      const VertexId v = refined.complex.cell_vertices(CellId{8 * c + corner})[corner];
      ASSERT_LT(v, refined.edge_points_begin);
      EXPECT_EQ(refined.origin[v], complex.cell_vertices(c)[corner]);
    }
  }
}

TEST(Refine, HalvesAFullySharpBox) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1, 8);
  oracle::sharpen_by_cells(mesh, 1);
  const CellComplex complex = make_cell_complex(mesh);
  const Refinement refined = refine(complex, all_cells(complex));
  for (std::uint32_t r = 0; r < 27; ++r) {
    const Vec3 p = apply_row(refined, r, mesh.positions) / 4;
    EXPECT_LT((p - p.array().round().matrix()).norm(), 1e-14) << "row " << r;
  }
}

TEST(Refine, CutsOutWhatTheChildrenNeedAndNoMore) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(5, 5, 5));
  const CellId middle{62};
  const Refinement part = refine(complex, std::array{middle});
  const Refinement whole = refine(complex, all_cells(complex));
  EXPECT_EQ(part.complex.cell_count(), 64u);  // 8 vertices with 8 children each.
  const std::vector<Vec3> points = oracle::box_mesh(5, 5, 5).positions;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const auto cut = part.complex.cell_vertices(CellId{part.first_child[0] + i});
    const auto full = whole.complex.cell_vertices(CellId{whole.first_child[middle] + i});
    for (std::size_t j = 0; j < 8; ++j) {
      EXPECT_LT((apply_row(part, cut[j], points) - apply_row(whole, full[j], points)).norm(), 1e-13);
      EXPECT_FALSE(part.complex.vertex_on_boundary(cut[j]));
    }
  }
}

TEST(Refine, PassesSharpEdgesAndVerticesOn) {
  ControlMesh mesh = oracle::box_mesh(1, 1, 1);
  mesh.sharp_edges = {{0, 1}};
  mesh.sharp_vertices = {7};
  const CellComplex complex = make_cell_complex(mesh);
  const Refinement refined = refine(complex, all_cells(complex));
  std::size_t sharp_edges = 0, sharp_vertices = 0;
  for (const EdgeId e : refined.complex.edges()) sharp_edges += refined.complex.edge_sharp(e);
  for (const VertexId v : refined.complex.vertices()) sharp_vertices += refined.complex.vertex_sharp(v);
  EXPECT_EQ(sharp_edges, 2u);
  EXPECT_EQ(sharp_vertices, 1u);
}

}  // namespace
}  // namespace ccslice
