// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Limit evaluation against brute force: tiny meshes refined as a whole, at the exact dyadic points that the masks give.

#include <gtest/gtest.h>

#include "tests/oracle/subject.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::oracle {
namespace {

constexpr double kTolerance = 1e-9;
/// Level 4 for meshes of up to 29 hexes, one less for each eightfold.
constexpr std::size_t kMostCells = 120'000;
constexpr std::size_t kMostRefinedVertices = 40;

class WholeMesh : public testing::TestWithParam<std::size_t> {};

TEST_P(WholeMesh, LimitAgreesWithBruteForce) {
  const Subject subject(tiny_meshes()[GetParam()].mesh);
  LimitEvaluator evaluator(subject.solid());
  BruteMesh mesh = subject.brute();
  BruteTopology topology = subject.topology();
  int level = 0;
  while (level < 4 && mesh.cells.size() * 8 <= kMostCells) {
    mesh = refine(mesh, topology).mesh;
    topology = build_topology(mesh.cells, mesh.vertex_count());
    ++level;
  }
  ASSERT_GE(level, 3);
  WorstError worst;
  std::vector<PointValue> limits(mesh.vertex_count());
  std::size_t refined = 0;
  for (std::size_t c = 0; c < mesh.cells.size(); ++c) {
    const BruteCell& cell = mesh.cells[c];
    for (const int bits : {static_cast<int>(c * 5 % 8), static_cast<int>(~(c * 5) % 8)}) {
      const std::uint32_t v = cell.v[kVtkCorner[bits]];
      if (limits[v].size() == 0) {
        if (!has_limit_mask(mesh, topology, v) && ++refined > kMostRefinedVertices) continue;
        limits[v] = limit_point(mesh, topology, v);
      }
      subject.compare(evaluator, subject.locate_corner(cell.from, bits), limits[v], worst);
    }
  }
  EXPECT_GT(worst.samples, mesh.cells.size());
  EXPECT_LT(worst.position, kTolerance) << worst.position_at;
  EXPECT_LT(worst.channel, kTolerance) << worst.channel_at;
}

INSTANTIATE_TEST_SUITE_P(TinyMeshes, WholeMesh, testing::Range<std::size_t>(0, tiny_meshes().size()),
                         [](const auto& info) { return tiny_meshes()[info.param].name; });

}  // namespace
}  // namespace ccslice::oracle
