// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/subdivision/refine_rules.h"

#include <gtest/gtest.h>

#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(RefineRules, KeepDataConstantAlongAStraightExtraordinaryEdge) {
  for (const int valence : {3, 5, 6, 7}) {
    const ControlMesh mesh = oracle::fan_mesh(valence, 1, 3);
    const CellComplex complex = make_cell_complex(mesh);
    // Heights away from the two caps are equidistant again, and places across the edge repeat from layer to layer.
    for (const VertexId v : complex.vertices()) {
      if (!on_straight_extraordinary_edge(complex, v)) continue;
      RuleRow row(complex);
      row.add_vertex_point(v);
      Stencils stencils;
      row.flush(stencils);
      Vec3 child;
      stencils.apply(0, 1, mesh.positions.front().data(), 3, child.data());
      EXPECT_LT((child - mesh.positions[v]).norm(), 1e-12) << "valence " << valence;
    }
  }
}

TEST(RefineRules, AddWeightedPointsToOneRow) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(1, 1, 1));
  RuleRow row(complex);
  row.add_cell_point(CellId{0}, 0.5);
  row.add_vertex(VertexId{3}, 0.5);
  Stencils stencils;
  row.flush(stencils);
  row.flush(stencils);
  ASSERT_EQ(stencils.rows(), 2u);
  EXPECT_EQ(stencils.offsets[1], 8u);
  EXPECT_EQ(stencils.weights[0], 0.0625);
  EXPECT_EQ(stencils.weights[3], 0.5625);
  EXPECT_EQ(stencils.offsets[2], 8u) << "a row was left over";
}

}  // namespace
}  // namespace ccslice
