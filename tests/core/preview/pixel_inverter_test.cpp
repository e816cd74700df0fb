// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pixels against exact inversion, and their slopes against differences of it.

#include "core/preview/pixel_inverter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/preview/painted_plane.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kPixels = 64;

class PixelInverterTest : public testing::Test {
 protected:
  PixelInverterTest() { inverter_.start(plane_.target(planes_), plane_.spec, *plane_.field, {}); }

  /// The first channel at a place in pixels.
  std::optional<double> exact(double column, double row) {
    const Vec3 place = plane_.lattice.centre(0, 0, plane_.layer.grid.layer_z_mm(0)) +
                       Vec3(column * plane_.lattice.dx_mm, row * plane_.lattice.dy_mm, 0);
    const auto found = plane_.field->invert(place, {});
    if (!found) return std::nullopt;
    std::vector<double> values(plane_.solid->channel_count());
    plane_.field->mat(found->at, values);
    return values.front();
  }

  std::shared_ptr<const LimitSolid> solid_ = prepare_solid(oracle::tiny_mesh("vertex_link_octahedron"));
  PaintedPlane plane_{solid_, Vec3(1, 2, 3), 0.45, kPixels, 1.0 / 256};
  PartPlanes planes_{plane_.layer, solid_->summary()};
  PixelInverter inverter_{solid_};
};

TEST_F(PixelInverterTest, ValuesAndSlopesAreThoseOfInversion) {
  constexpr double kStep = 0.01;
  const ChannelRange& range = solid_->summary().channels.front();
  std::size_t smooth = 0, all = 0;
  for (const VoxelRun& span : plane_.spans) {
    for (std::uint32_t x = span.begin; x < span.end; x += 3) {
      const std::uint32_t number = inverter_.invert(x, span.row);
      ++all;
      if (!inverter_.pixel(number).smooth) continue;
      const SurfaceSample& sample = inverter_.sample(number, 0);
      const auto value = exact(x, span.row), right = exact(x + kStep, span.row), left = exact(x - kStep, span.row),
                 above = exact(x, span.row + kStep), below = exact(x, span.row - kStep);
      if (!value || !right || !left || !above || !below) continue;
      ++smooth;
      EXPECT_NEAR(sample.value, *value, 2e-4 * (range.max - range.min)) << x << ", " << span.row;
      const Vec2 slope = Vec2(*right - *left, *above - *below) / (2 * kStep);
      EXPECT_LT((sample.slope - slope).norm(), 0.02 * slope.norm() + 1e-3 * (range.max - range.min));
    }
  }
  EXPECT_GT(smooth, 9 * all / 10);
}

TEST_F(PixelInverterTest, KnowsWhatItHasBeenAskedFor) {
  const VoxelRun& span = plane_.spans[plane_.spans.size() / 2];
  EXPECT_FALSE(inverter_.find(span.begin, span.row));
  const std::uint32_t number = inverter_.invert(span.begin, span.row);
  EXPECT_EQ(inverter_.find(span.begin, span.row), number);
  EXPECT_EQ(inverter_.invert(span.begin, span.row), number);
  EXPECT_EQ(inverter_.pixel(number).row, span.row);
  inverter_.invert(span.begin + 1, span.row);
  EXPECT_EQ(inverter_.count(), 2u);
  inverter_.forget_after(1);
  EXPECT_EQ(inverter_.count(), 1u);
  EXPECT_FALSE(inverter_.find(span.begin + 1, span.row));
  EXPECT_EQ(inverter_.find(span.begin, span.row), number);
  inverter_.start(plane_.target(planes_), plane_.spec, *plane_.field, {});
  EXPECT_FALSE(inverter_.find(span.begin, span.row));
}

TEST_F(PixelInverterTest, GuessesTheParametersOfNeighbours) {
  const VoxelRun& span = plane_.spans[plane_.spans.size() / 2];
  const std::uint32_t column = (span.begin + span.end) / 2;
  const std::uint32_t number = inverter_.invert(column, span.row), beside = inverter_.invert(column + 1, span.row);
  const CellParam guess = inverter_.guess(number, column + 1, span.row);
  if (inverter_.pixel(beside).at.cell == guess.cell) {
    EXPECT_LT((inverter_.pixel(beside).at.uvw - guess.uvw).norm(), 0.05);
  }
  EXPECT_EQ(inverter_.guess(number, column, span.row).uvw, inverter_.pixel(number).at.uvw);
}

TEST_F(PixelInverterTest, OutsideNothingIsSmooth) { EXPECT_FALSE(inverter_.pixel(inverter_.invert(0, 0)).smooth); }

}  // namespace
}  // namespace ccslice
