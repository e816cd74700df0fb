// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/level.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <map>

#include "core/limit/boundary_surface.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/limit_solid.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

// Faces of several cut-outs meet: equal keys <=> equal places, on corners and middles of sides.
TEST(Level, NamesPlacesAlikeInAllCutOuts) {
  const auto solid = prepare_solid(oracle::kuhn_box(6));
  const double diagonal = solid->summary().bounding_box.diagonal().norm();
  LimitEvaluator evaluator(*solid);
  const BoundarySurface surface(*solid);
  std::map<SurfaceKey, Vec3> places;
  for (const BoundaryFaceId f : surface.face_ids()) {
    for (std::uint32_t i = 0; i < 9; ++i) {
      const std::uint32_t s = i % 3 * (kSurfaceOne / 2), t = i / 3 * (kSurfaceOne / 2);
      const Vec3 p = evaluator.geo(surface.cell_param(f, i % 3 / 2.0, i / 3 / 2.0));
      const auto [known, fresh] = places.try_emplace(surface.key(f, s, t), p);
      EXPECT_LT((known->second - p).norm(), 1e-11 * diagonal) << "face " << f;
    }
  }
  std::map<std::array<long, 3>, SurfaceKey> keys;
  for (const auto& [key, p] : places) {
    const Vec3 steps = p / (1e-7 * diagonal);
    const auto [known, fresh] =
        keys.try_emplace({std::lround(steps.x()), std::lround(steps.y()), std::lround(steps.z())}, key);
    EXPECT_TRUE(fresh) << "two keys at " << p.transpose();
  }
}

// Whatever order cells are walked in, faces come by their cells.
TEST(Level, FacesComeInTheOrderOfTheirCells) {
  const auto solid = prepare_solid(oracle::kuhn_box(6));
  const BoundarySurface surface(*solid);
  ASSERT_EQ(surface.faces().size(), 6u * 36 * 2 * 12);
  for (std::size_t f = 1; f < surface.faces().size(); ++f) {
    const BoundaryFace &last = surface.faces()[f - 1], &face = surface.faces()[f];
    EXPECT_TRUE(last.cell < face.cell || (last.cell == face.cell && last.cell_side < face.cell_side)) << "face " << f;
  }
}

}  // namespace
}  // namespace ccslice
