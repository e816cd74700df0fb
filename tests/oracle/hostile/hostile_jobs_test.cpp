// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The first seeds of random jobs that nobody tuned anything for (hostile_check.h). tests/bench/hostile_jobs tries more,
// and one alone: --seeds N --verbose.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/oracle/hostile/hostile_check.h"

namespace ccslice::oracle {
namespace {

constexpr std::uint64_t kSeeds = 300, kSeedsACase = 10;

class HostileJobs : public testing::TestWithParam<std::uint64_t> {};

TEST_P(HostileJobs, KeepWhatIsPromised) {
  std::uint64_t sliced = 0;
  for (std::uint64_t i = 0; i < kSeedsACase; ++i) {
    const HostileResult result = run_hostile_seed(GetParam() + i);
    sliced += result.refused.empty();
    EXPECT_FALSE(result.failed()) << to_text(result);
  }
  EXPECT_GT(sliced, 0u) << "nothing is tested here";
}

INSTANTIATE_TEST_SUITE_P(Seeds, HostileJobs, testing::Range<std::uint64_t>(1, kSeeds + 1, kSeedsACase),
                         [](const auto& info) { return "from_" + std::to_string(info.param); });

// Whatever they paint, its errors are bounded.
TEST_P(HostileJobs, KeepWhatIsPromisedIfTheyAskForProof) {
  for (std::uint64_t seed = GetParam(); seed < GetParam() + kSeedsACase; seed += 4) {
    const HostileResult result = run_hostile_seed(seed, {.files = {}, .prove = true});
    EXPECT_FALSE(result.failed()) << to_text(result);
  }
}

// A part of 0.017 mm that folds. Its 960 cells are all nearer to a voxel than voxels may lie off the solid, and the one
// that holds it was among the last to be searched: two voxels took another one's material.
TEST(HostileJob, FindsTheCellThatHoldsAVoxelAmongAllThatComeNear) {
  const HostileResult result = run_hostile_seed(10529, {.files = {}, .only_channels = true, .only_subdivided = true});
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kTruth].compared, 50u);
}

/// Hexahedra in a ring, all of whose long edges are smooth and have one of them.
ControlMesh ring_of_hexahedra(std::uint32_t count) {
  ControlMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const double angle = 2 * EIGEN_PI * i / count;
    for (const double radius : {10, 15}) {
      for (const double z : {0, 6}) mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
    const std::uint32_t here = 4 * i, next = 4 * ((i + 1) % count);
    mesh.cell_kinds.push_back(CellKind::kHex);
    for (const std::uint32_t at : {here, here + 2, next + 2, next, here + 1, here + 3, next + 3, next + 1}) {
      mesh.cell_vertices.push_back(at);
    }
  }
  return mesh;
}

// Voxels just off a part of a hundredth of a millimetre: Newton's method got stuck inside, within a micrometre of them,
// and their materials were 150 and 90 times the tolerance away from those of the boundary beside them.
TEST(HostileJob, TakesTheNearestPlaceBesideSmoothEdges) {
  std::vector<NamedMesh> rings;
  for (const std::uint32_t count : {4, 5, 6, 8}) rings.push_back({"ring", ring_of_hexahedra(count)});
  for (const std::uint64_t seed : {174, 1101}) {
    const HostileResult result =
        run_hostile_seed(seed, {.most_voxels = 60000, .files = rings, .only_channels = true, .only_subdivided = true});
    EXPECT_FALSE(result.failed()) << to_text(result);
    EXPECT_GT(result[HostileCheck::kTolerance].compared, 5000u);
  }
}

// Pieces of vertex cells were 1.2 times beyond the tolerance near a corner of a face, between all places where they had
// been looked at. No voxel lay there.
TEST(HostileJob, PiecesKeepTheToleranceWhereNoVoxelLies) {
  const HostileResult result = run_hostile_seed(53068, {.files = {}, .only_subdivided = true});
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kPieces].compared, 500u);
}

// Triangles of a cell reached across an edge into one of another cell region, by so thin a sliver that the place beyond
// it that was looked at lay in a third cell: 988 times the tolerance.
TEST(HostileJob, TrianglesKeepTheToleranceInCellsAcrossAnEdge) {
  const HostileResult result = run_hostile_seed(50699, {.files = {}, .only_subdivided = true});
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kShells].compared, 200u);
}

// Triangles of cells that are on the boundary by a reentrant edge alone reached into the air there, by less than the
// contours' tolerance: 2.8 times the tolerance of materials, which polynomials were followed by.
TEST(HostileJob, TrianglesKeepTheToleranceInTheAirBesideReentrantEdges) {
  const HostileResult result = run_hostile_seed(51762, {.files = {}, .only_subdivided = true});
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kShells].compared, 25u);
}

// At vertices where maps degenerate triangles end in slivers of cells whose materials are steep without bound. A tenth
// of a voxel wide, they are between all places that are looked at: 1.06 of the tolerance. If proof is asked for, those
// pieces are smaller, or know what is beyond them.
TEST(HostileJob, TrianglesKeepTheToleranceWhereMapsDegenerateIfProofIsAskedFor) {
  for (const std::uint64_t seed : {8695, 9136}) {
    const HostileResult sampled = run_hostile_seed(seed, {.files = {}, .only_subdivided = true}),
                        proved = run_hostile_seed(seed, {.files = {}, .only_subdivided = true, .prove = true});
    EXPECT_FALSE(sampled.failed()) << to_text(sampled);
    EXPECT_FALSE(proved.failed()) << to_text(proved);
    EXPECT_LT(proved[HostileCheck::kShells].worst, 1);
    EXPECT_GT(proved[HostileCheck::kShells].compared, 20u);
  }
}

// A piece was followed across a gap into the next cell, where slopes jump as meshed: 3.5 times the tolerance.
TEST(HostileJob, PiecesAsMeshedAreNotFollowedFarBeyondAKink) {
  const HostileResult result = run_hostile_seed(3234);
  EXPECT_FALSE(result.failed()) << to_text(result);
  EXPECT_GT(result[HostileCheck::kTolerance].compared, 20000u);
}

// Checks of what no seed draws would pass for want of cases.
TEST(HostileJob, MeetsAllKindsOfRegionsPlanesAndMaterials) {
  std::string all;
  for (std::uint64_t seed = 1; seed <= 150; ++seed) {
    const HostileResult result = run_hostile_seed(seed, {.files = {}, .only_linear = true, .only_subdivided = true});
    if (result.refused.empty()) all += result.description + "\n";
  }
  for (const char* what : {"regions, bands",
                           "regions, about centres",
                           "regions, one cell",
                           "regions, each cell",
                           "regions, all in one",
                           "jumping",
                           "cell regions shown",
                           " pure",
                           " direct",
                           " blend",
                           " curve",
                           " colour",
                           " region 1 ",
                           "BLUE_NOISE",
                           "ERROR_DIFFUSION",
                           "LARGEST_FRACTION",
                           "WHITE_NOISE",
                           " alone",
                           "a strict map",
                           "a strict map that covers",
                           "RAW_ZSTD",
                           "PNG_ALPHA",
                           "columns descending",
                           "rows descending",
                           "contours by region"}) {
    EXPECT_NE(all.find(what), std::string::npos) << what;
  }
}

TEST(HostileJob, IsTheSameForTheSameSeed) {
  const HostileResult once = run_hostile_seed(7), again = run_hostile_seed(7);
  EXPECT_EQ(once.description, again.description);
  EXPECT_EQ(once.voxels, again.voxels);
  EXPECT_EQ(once[HostileCheck::kTolerance].worst, again[HostileCheck::kTolerance].worst);
}

}  // namespace
}  // namespace ccslice::oracle
