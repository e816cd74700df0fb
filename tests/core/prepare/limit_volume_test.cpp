// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/limit_volume.h"

#include <gtest/gtest.h>

#include <numeric>

#include "core/base/error.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(LimitVolume, MissesLessThanItsHeaderSays) {
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    const auto solid = prepare_solid(mesh);
    const double exact = limit_volume_mm3(BoundarySurface(*solid), 40);
    EXPECT_NEAR(limit_volume_mm3(BoundarySurface(*solid)), exact, 2e-6 * exact) << name;
    EXPECT_EQ(solid->summary().deviation.limit_volume_mm3, limit_volume_mm3(BoundarySurface(*solid))) << name;
  }
}

/// Fluxes are those through faces in their order, whatever thread found which.
TEST(LimitVolume, IsTheSameForAnyNumberOfThreads) {
  const auto solid = prepare_solid(oracle::box_mesh(9, 9, 9, 10, [](int i, int j, int k) { return i + j + k; }));
  const BoundarySurface surface(*solid);
  const auto fluxes = face_fluxes_mm3(surface, surface.faces(), kVolumeLevels, 1, {});
  EXPECT_EQ(fluxes, face_fluxes_mm3(surface, surface.faces(), kVolumeLevels, 2, {}));
  EXPECT_EQ(std::accumulate(fluxes.begin(), fluxes.end(), 0.0), limit_volume_mm3(surface, kVolumeLevels, 2));
}

TEST(LimitVolume, CanBeCancelled) {
  const auto solid = prepare_solid(oracle::box_mesh(2, 2, 2));
  const CancellationToken cancel = CancellationToken::make();
  cancel.cancel();
  EXPECT_THROW((void)limit_volume_mm3(BoundarySurface(*solid), kVolumeLevels, 1, cancel), Error);
}

}  // namespace
}  // namespace ccslice
