// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/brick_blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_data.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/refined_mesh.h"

namespace ccslice {
namespace {

/// A box of cells whose vertices and values are random.
std::shared_ptr<const LimitSolid> random_box(double move_mm) {
  BoxShape shape;
  shape.cells_x = 5, shape.cells_y = 4, shape.cells_z = 3;
  shape.size_mm = Vec3(50, 40, 30);
  ControlMesh mesh = make_box(shape);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  for (Vec3& vertex : mesh.positions) vertex += move_mm * Vec3(number(random), number(random), number(random));
  mesh.channel_names = {"a", "b", "c"};
  mesh.channel_values.resize(3 * mesh.vertex_count());
  for (float& value : mesh.channel_values) value = static_cast<float>(number(random));
  return prepare_solid(mesh);
}

/// What 5 x 5 x 5 values make of a polynomial of degree 4 along each axis, at shares of their box.
double interpolated(const BlockValues& values, const Vec3& share) {
  std::array<std::array<double, kBlockNodes>, 3> weights;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t n = 0; n < kBlockNodes; ++n) {
      double weight = 1;
      for (std::size_t q = 0; q < kBlockNodes; ++q) {
        const double place = static_cast<double>(q) / 4, own = static_cast<double>(n) / 4;
        if (q != n) weight *= (share[static_cast<Eigen::Index>(a)] - place) / (own - place);
      }
      weights[a][n] = weight;
    }
  }
  double sum = 0;
  for (std::size_t node = 0; node < kBlockPoints; ++node) {
    const std::size_t i = node % 5, j = node / 5 % 5, k = node / 25, slot = block_slot(node);
    sum += weights[0][i] * weights[1][j] * weights[2][k] * values[slot / kLanes][slot % kLanes];
  }
  return sum;
}

/// The largest differences of a brick's limit from what its samples say, at random places of the box.
struct Differences {
  Vec3 position = Vec3::Zero();
  std::vector<double> values;
};

Differences differences(const LimitSolid& solid, const CellBrick& brick, const ParamBox& box, const CellBlock& block,
                        const std::vector<std::uint32_t>& channels) {
  LimitEvaluator evaluator(solid);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> share(0, 1);
  std::vector<double> values(solid.channel_count());
  Differences result{Vec3::Zero(), std::vector<double>(channels.size())};
  for (int n = 0; n < 300; ++n) {
    const Vec3 at(share(random), share(random), share(random));
    const Vec3 uvw = box.low + at.cwiseProduct(box.high - box.low);
    const Vec3 position = evaluator.geo_and_mat(solid.data().bricks.cell_param(brick, uvw), values);
    for (int a = 0; a < 3; ++a) {
      const double found = interpolated(block.position[static_cast<std::size_t>(a)], at);
      result.position[a] = std::max(result.position[a], std::abs(position[a] - found));
    }
    for (std::size_t c = 0; c < channels.size(); ++c) {
      result.values[c] = std::max(result.values[c], std::abs(values[channels[c]] - interpolated(block.values[c], at)));
    }
  }
  return result;
}

// Boxes that end at knots and between them, in bricks with and without phantom layers.
TEST(BrickBlocks, ResidualsBoundWhatSamplesLeaveOut) {
  const auto solid = random_box(0.8);
  const CellBricks& bricks = solid->data().bricks;
  const std::vector<std::uint32_t> channels = {2, 0};
  BrickSampler sampler(*solid, channels);
  CellBlock block;
  BrickResiduals residuals;
  ASSERT_GT(bricks.size(), 0U);
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const Vec3 end(bricks[b].cells[0], bricks[b].cells[1], bricks[b].cells[2]);
    for (const ParamBox& box :
         {ParamBox{Vec3::Zero(), end}, ParamBox{0.25 * end, 0.75 * end}, ParamBox{0.5 * end, end},
          ParamBox{Vec3::Zero(), Vec3(1, 0.5, end.z())}, ParamBox{Vec3(0.75, 0.5, 0), Vec3(1, 0.53125, 0.0625)}}) {
      sampler.sample(bricks[b], box, block, residuals);
      const Differences found = differences(*solid, bricks[b], box, block, channels);
      const bool in_one_cell = ((box.high.array() - 1e-9).floor() <= box.low.array().floor()).all();
      for (int a = 0; a < 3; ++a) {
        EXPECT_LE(found.position[a], residuals.position[a] + 1e-11);
        EXPECT_GE(found.position[a], in_one_cell ? 0 : 2e-3 * residuals.position[a]) << "a bound that says something";
      }
      for (std::size_t c = 0; c < channels.size(); ++c) {
        EXPECT_LE(found.values[c], residuals.values[c] + 1e-12);
        EXPECT_GE(found.values[c], in_one_cell ? 0 : 2e-3 * residuals.values[c]);
        if (in_one_cell) {
          EXPECT_EQ(residuals.values[c], 0);
        }
      }
    }
  }
}

TEST(BrickBlocks, WithinACellSamplesAreThoseOfTheCell) {
  const auto solid = random_box(0.8);
  const CellBricks& bricks = solid->data().bricks;
  LimitEvaluator evaluator(*solid);
  const std::vector<std::uint32_t> channels = {0, 1, 2};
  CellBlockSampler cells(evaluator, channels);
  BrickSampler sampler(*solid, channels);
  CellBlock block, expected;
  BrickResiduals residuals;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    const Vec3 low(bricks[b].cells[0] - 1, 0, bricks[b].cells[2] - 1);
    sampler.sample(bricks[b], {low, low + Vec3(1, 1, 1)}, block, residuals);
    for (std::size_t node = 0; node < kBlockPoints; ++node) {
      const Vec3 share(0.25 * static_cast<double>(node % 5), 0.25 * static_cast<double>(node / 5 % 5),
                       0.25 * static_cast<double>(node / 25));
      std::vector<double> values(3);
      // From within the cell, as a place on its side is its neighbour's, too.
      const CellParam middle = bricks.cell_param(bricks[b], low + Vec3::Constant(0.5));
      const CellBricks::Cell& cell = *std::ranges::find(bricks.cells(bricks[b]), middle.cell, &CellBricks::Cell::cell);
      const Vec3 position = evaluator.geo_and_mat({cell.cell, cell.frame.from_framed(share)}, values);
      const std::size_t slot = block_slot(node);
      EXPECT_LT((at_slot(block.position, slot) - position).norm(), 1e-11);
      for (std::size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(block.values[c][slot / kLanes][slot % kLanes], values[c], 1e-12);
      }
    }
    EXPECT_EQ(residuals.position.maxCoeff(), 0);
    EXPECT_EQ(residuals.bulge.maxCoeff(), 0);
  }
}

// Along its first axis it goes up, down and up again, and turns between samples.
TEST(BrickBlocks, BulgesBoundWhatLiesBeyondTheSamples) {
  BoxShape shape;
  shape.cells_x = 12, shape.cells_y = shape.cells_z = 4;
  shape.size_mm = Vec3(12, 0.4, 4);
  ControlMesh mesh = make_box(shape);
  for (Vec3& vertex : mesh.positions) {
    const double along = std::clamp(std::round(vertex.x()), 3.0, 9.0) - 6;
    vertex.y() += along * along * along - 7.75 * along;  // Control points of t^3 - 6.75 t.
  }
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  BrickSampler sampler(*solid, {});
  CellBlock block;
  BrickResiduals residuals;
  const CellBricks& bricks = solid->data().bricks;
  ASSERT_EQ(bricks.size(), 3U);
  double farthest = 0;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    sampler.sample(bricks[b], {Vec3::Zero(), Vec3(4, 4, 4)}, block, residuals);
    Box3 samples, limit;
    for (std::size_t node = 0; node < kBlockPoints; ++node) samples.extend(at_slot(block.position, block_slot(node)));
    for (int n = 0; n <= 64; ++n) limit.extend(evaluator.geo(bricks.cell_param(bricks[b], Vec3(n / 16.0, 0, 0))));
    const Vec3 beyond = (samples.min() - limit.min()).cwiseMax(limit.max() - samples.max());
    for (int a = 0; a < 3; ++a) EXPECT_LE(beyond[a], residuals.bulge[a] + residuals.position[a] + 1e-12);
    if (residuals.position.maxCoeff() < 1e-9) farthest = std::max(farthest, beyond.y() / samples.sizes().y());
  }
  EXPECT_GT(farthest, 0.08) << "nothing is tested here";
}

// Refined cells are parts of one patch.
TEST(BrickBlocks, NothingIsLeftOutOfARefinedPatch) {
  const auto solid = prepare_solid(refine_mesh(make_ring(), 2));
  const CellBricks& bricks = solid->data().bricks;
  BrickSampler sampler(*solid, {});
  CellBlock block;
  BrickResiduals residuals;
  for (std::uint32_t b = 0; b < bricks.size(); ++b) {
    sampler.sample(bricks[b], {Vec3::Zero(), Vec3(4, 4, 4)}, block, residuals);
    EXPECT_LT(residuals.position.maxCoeff(), 1e-11);
  }
}

}  // namespace
}  // namespace ccslice
