// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_trials.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "core/prepare/prepare_solid.h"
#include "core/slicer/channel_tolerances.h"
#include "tests/core/mesh/expect_error.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

/// A box of 6 x 6 x 6 cells of 2 mm, each of 10 x 10 x 10 voxels, or as meshed of the same, with one channel.
bool tiles_fit(const std::function<double(const Vec3&)>& material, double tolerance, bool as_meshed = false,
               const CancellationToken& cancel = {}) {
  ControlMesh mesh = oracle::box_mesh(6, 6, 6, 2);
  mesh.as_meshed = as_meshed;
  mesh.channel_names = {"m"};
  mesh.channel_values.clear();
  for (const Vec3& p : mesh.positions) mesh.channel_values.push_back(static_cast<float>(material(p)));
  const auto solid = prepare_solid(mesh);
  SliceJob job = job_of(solid, {0.2, 0.2, 0.2});
  job.channel_tolerance = tolerance;
  return do_tiles_fit(solid, interpolation_spec_of(job, solid->summary().channels), cancel);
}

double wave(const Vec3& p) { return std::sin(p.x()) * std::cos(p.y() + p.z()); }

TEST(DoTilesFit, WhereMaterialsAreSmoothForTheTolerance) {
  EXPECT_TRUE(tiles_fit([](const Vec3&) { return 0.5; }, 1e-6));
  EXPECT_TRUE(tiles_fit(wave, 1));
  EXPECT_FALSE(tiles_fit(wave, 1e-6));
}

// The same values, whose slopes jump between cells.
TEST(DoTilesFit, AcrossNoKinks) {
  const auto bent = [](const Vec3& p) { return (p.x() - 6) * (p.x() - 6) / 36; };
  EXPECT_TRUE(tiles_fit(bent, 0.016));
  EXPECT_FALSE(tiles_fit(bent, 0.016, true));
}

int polls = 0;
CancellationToken cancelled_at_third_poll;

TEST(DoTilesFit, IsCancelledBetweenTrials) {
  polls = 0;
  cancelled_at_third_poll = CancellationToken::make([]() noexcept {
    if (++polls == 3) cancelled_at_third_poll.cancel();
  });
  expect_error([] { (void)tiles_fit(wave, 1, false, cancelled_at_third_poll); }, ErrorCode::kCancelled, "cancelled");
  EXPECT_EQ(polls, 3);
}

TEST(TileTrials, SkipHalfOfWhatWasInVainSoFar) {
  TileTrials trials(true);
  EXPECT_TRUE(trials.are_promising());
  EXPECT_FALSE(trials.skip(1)) << "nothing was tried";
  trials.note(1000, false);
  EXPECT_FALSE(trials.are_promising());
  EXPECT_FALSE(trials.skip(501));
  EXPECT_TRUE(trials.skip(300));
  EXPECT_FALSE(trials.skip(300)) << "500 in all";
  EXPECT_TRUE(trials.skip(200));
  trials.note(500, false);
  EXPECT_TRUE(trials.skip(1000)) << "half of 2000, skipped ones included";
  EXPECT_FALSE(trials.skip(1));
}

TEST(TileTrials, SkipNothingOnceAPartFits) {
  TileTrials trials(false);
  EXPECT_FALSE(trials.are_promising());
  trials.note(1000, false);
  trials.note(10, true);
  EXPECT_TRUE(trials.are_promising());
  EXPECT_FALSE(trials.skip(1));
}

}  // namespace
}  // namespace ccslice
