// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

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

/// Where the cell across each side is, as the number of one of its vertices that the side lacks.
std::vector<std::uint32_t> beyond_sides(const CutOut& cut_out, CellId cell) {
  std::vector<std::uint32_t> beyond;
  for (const HalfFaceId h : cut_out.complex.cell_half_faces(cell)) {
    const CellId next = cut_out.complex.half_face_cell(opposite(h));
    const auto ring = cut_out.complex.face_vertices(face_of(h));
    beyond.push_back(kNone);
    if (next == kNone) continue;
    for (const VertexId v : cut_out.complex.cell_vertices(next)) {
      if (std::ranges::find(ring, v) == ring.end()) beyond.back() = std::min(beyond.back(), +cut_out.numbers[v]);
    }
  }
  return beyond;
}

// What is walked in a cut-out comes in the order that it has among all children.
TEST(Refine, CutsOutCellsAsTheyAreAmongAll) {
  ControlMesh mesh = oracle::kuhn_box(3);
  oracle::sharpen_by_cells(mesh, 1);
  const CellComplex complex = make_cell_complex(mesh);
  const ChildVertices children(complex, all_cells(complex));
  CutOutMaker maker(complex, children);
  const CutOut all = maker.make(all_cells(complex), {});
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    std::vector<CellId> some;
    for (const CellId c : complex.cells()) {
      if (random() % 8 == 0) some.push_back(c);
    }
    const CutOut part = maker.make(some, {});
    ASSERT_TRUE(std::ranges::is_sorted(part.numbers));
    const auto number = [&](VertexId v) { return part.numbers[v]; };
    const auto in_all = [&](VertexId v) { return VertexId{number(v)}; };
    for (std::size_t i = 0; i < some.size(); ++i) {
      for (std::uint32_t k = 0; k < 4; ++k) {
        const CellId here{part.first_child[i] + k}, there{all.first_child[some[i]] + k};
        const auto vertices = part.complex.cell_vertices(here);
        EXPECT_TRUE(std::ranges::equal(vertices, all.complex.cell_vertices(there), {}, number));
        EXPECT_EQ(beyond_sides(part, here), beyond_sides(all, there));
        for (const VertexId v : vertices) {
          EXPECT_EQ(part.complex.vertex_on_boundary(v), all.complex.vertex_on_boundary(in_all(v)));
          EXPECT_EQ(part.complex.vertex_sharp(v), all.complex.vertex_sharp(in_all(v)));
          const auto edges = part.complex.vertex_edges(v), edges_of_all = all.complex.vertex_edges(in_all(v));
          ASSERT_EQ(edges.size(), edges_of_all.size());
          for (std::size_t e = 0; e < edges.size(); ++e) {
            EXPECT_EQ(number(part.complex.edge_other(edges[e], v)), all.complex.edge_other(edges_of_all[e], in_all(v)));
            EXPECT_EQ(part.complex.edge_sharp(edges[e]), all.complex.edge_sharp(edges_of_all[e]));
          }
        }
      }
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
