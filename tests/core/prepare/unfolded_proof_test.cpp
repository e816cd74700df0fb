// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/unfolded_proof.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <vector>

#include "core/base/error.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

struct Proofs {
  std::size_t cells = 0, proved = 0, folding = 0;
};

/// Samples det J of each cell, also near to irregular lines and vertices: nowhere may it be negative where the cell is
/// proved to be unfolded.
Proofs compare(const ControlMesh& mesh, std::uint32_t cells_together, std::uint32_t seed) {
  const auto solid = prepare_solid(mesh);
  const LimitSolid::Data& data = solid->data();
  LineFolds lines(data);
  const VertexFolds vertices(lines);
  UnfoldedProof proof(data, lines, vertices, {3, 3, 1, 6});
  LimitEvaluator evaluator(*solid);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> share;
  const auto coordinate = [&] {
    const double near = std::exp2(-6 * share(random)) * share(random);
    return share(random) < 0.5 ? near : 1 - near;
  };
  Proofs found;
  const std::vector<LimitCellId> cells = solid->cells().to_vector();
  std::vector<std::uint8_t> proved(cells.size());
  for (std::size_t begin = 0; begin < cells.size(); begin += cells_together) {
    const auto together = std::span(cells).subspan(begin, std::min<std::size_t>(cells_together, cells.size() - begin));
    proof.examine(together, {}, proved);
    for (const LimitCellId c : together) {
      double least = 1;
      for (int i = 0; i < 100; ++i) {
        const Vec3 uvw(coordinate(), coordinate(), coordinate());
        least = std::min(least, evaluator.sample({c, uvw}).jacobian.determinant());
      }
      ++found.cells;
      found.proved += proved[c];
      found.folding += least <= 0;
      if (proved[c]) {
        EXPECT_GT(least, 0) << "cell " << c;
      }
    }
  }
  return found;
}

TEST(UnfoldedProof, ProvesNearlyAllOfSaneMeshes) {
  std::size_t cells = 0, proved = 0;
  for (const ControlMesh& mesh : {oracle::fan_mesh(5, 2, 4), oracle::kuhn_box(3)}) {
    const Proofs found = compare(mesh, 4096, 1);
    EXPECT_EQ(found.folding, 0u);
    cells += found.cells;
    proved += found.proved;
  }
  EXPECT_GT(proved, cells * 9 / 10);
}

TEST(UnfoldedProof, ProvesNoCellOfTheCatalogueThatFolds) {
  for (const auto& tiny : oracle::tiny_meshes()) {
    SCOPED_TRACE(tiny.name);
    compare(tiny.mesh, 100, 2);
  }
}

/// Cells that share registers don't share proofs.
TEST(UnfoldedProof, ProvesNoCellOfCrumpledMeshesThatFolds) {
  Proofs all;
  for (std::uint32_t seed = 1; seed <= 10; ++seed) {
    ControlMesh mesh = seed % 2 == 0 ? oracle::kuhn_box(2) : oracle::fan_mesh(5, 2, 3);
    mesh.allow_folds = true;
    oracle::jitter(mesh, 0.5 * seed, seed);
    const Proofs found = compare(mesh, 1024, seed);
    all.cells += found.cells;
    all.proved += found.proved;
    all.folding += found.folding;
  }
  EXPECT_GT(all.folding, 50u);
  EXPECT_GT(all.proved, all.cells / 4);
}

TEST(UnfoldedProof, StopsWhenItIsCancelled) {
  const auto solid = prepare_solid(oracle::kuhn_box(2));
  LineFolds lines(solid->data());
  const VertexFolds vertices(lines);
  UnfoldedProof proof(solid->data(), lines, vertices, {3, 3, 1, 6});
  PrepareOptions options;
  options.cancel = CancellationToken::make();
  options.cancel.cancel();
  std::vector<std::uint8_t> proved(solid->cell_count());
  EXPECT_THROW(proof.examine(solid->cells().to_vector(), options, proved), Error);
}

}  // namespace
}  // namespace ccslice
