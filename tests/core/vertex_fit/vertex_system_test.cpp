// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/vertex_fit/vertex_system.h"

#include <gtest/gtest.h>

#include <random>

#include "core/base/error.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

VertexSystem::Values random_values(std::uint32_t rows, int columns) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> value(-1, 1);
  return VertexSystem::Values::NullaryExpr(rows, columns, [&] { return value(random); });
}

TEST(VertexSystem, MovesLimitPointsAsAsked) {
  for (const char* name : {"box_4", "hex_wedge_tet", "sharp_2_hexes_dart"}) {
    const CellComplex complex = make_cell_complex(oracle::tiny_mesh(name));
    const VertexSystem system(complex);
    const VertexSystem::Values moves = random_values(complex.vertex_count(), 3);
    EXPECT_LT((system.limits(system.solve(moves)) - moves).cwiseAbs().maxCoeff(), 1e-9) << name;
  }
}

TEST(VertexSystem, MovesTheBoundaryAlikeWhateverFollowsInside) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(4, 3, 3));
  const VertexSystem system(complex);
  const VertexSystem::Values moves = random_values(complex.vertex_count(), 2);
  const VertexSystem::Values all = system.solve(moves), boundary = system.solve_boundary(moves);
  for (const VertexId v : complex.vertices()) {
    ASSERT_EQ(system.on_boundary(v), complex.vertex_on_boundary(v));
    if (system.on_boundary(v)) {
      EXPECT_EQ(all.row(v), boundary.row(v)) << v;
      continue;
    }
    VertexSystem::Values around = VertexSystem::Values::Zero(1, 2);
    for (const EdgeId e : complex.vertex_edges(v)) around += boundary.row(complex.edge_other(e, v)) / 6;
    EXPECT_LT((boundary.row(v) - around).norm(), 1e-9) << v;
  }
}

TEST(VertexSystem, MovesAllControlPointsAlikeIfAllLimitPointsMoveAlike) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(3, 3, 3));
  const VertexSystem system(complex);
  const VertexSystem::Values moves = VertexSystem::Values::Constant(complex.vertex_count(), 1, 2.5);
  EXPECT_LT((system.solve(moves) - moves).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((system.solve_boundary(moves) - moves).cwiseAbs().maxCoeff(), 1e-9);
}

/// In a smooth cube the limit of a vertex doesn't depend on the difference between its even and its odd corners.
TEST(VertexSystem, ComesAsNearAsItCanWhereNoControlPointsDo) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(1, 1, 1));
  const VertexSystem system(complex);
  VertexSystem::Values moves = VertexSystem::Values::Zero(8, 1);
  moves(0, 0) = 1;
  const VertexSystem::Values missed = system.limits(system.solve(moves)) - moves;
  // What is missed is the part of `moves` that alternates from corner to corner: an eighth of it.
  EXPECT_LT((missed.cwiseAbs() - VertexSystem::Values::Constant(8, 1, 0.125)).cwiseAbs().maxCoeff(), 1e-8);
}

/// A cube written with ten digits is off what can be reached by rounding only: that isn't blown up.
TEST(VertexSystem, AmplifiesNoRounding) {
  const CellComplex complex = make_cell_complex(oracle::box_mesh(1, 1, 1));
  const VertexSystem system(complex);
  for (const double rounding : {1e-8, 1e-9, 1e-10, 1e-11, 1e-12}) {
    VertexSystem::Values moves(8, 1);
    moves << 0, 1, 1, 0, 0, 1, 1, 0;
    moves(0, 0) += rounding;
    const VertexSystem::Values solved = system.solve(moves);
    EXPECT_LT(solved.cwiseAbs().maxCoeff(), 3) << rounding;
    EXPECT_LT((system.limits(solved) - moves).cwiseAbs().maxCoeff(), rounding) << rounding;
  }
}

TEST(VertexSystem, StopsWhenCancelled) {
  const auto token = CancellationToken::make();
  token.cancel();
  const CellComplex complex = make_cell_complex(oracle::box_mesh(6, 6, 6));
  EXPECT_THROW(VertexSystem(complex, token), Error);
}

}  // namespace
}  // namespace ccslice
