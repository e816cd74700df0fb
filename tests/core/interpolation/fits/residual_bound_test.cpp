// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/fits/residual_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <utility>
#include <vector>

#include "core/limit/limit_evaluator.h"
#include "core/prepare/prepare_solid.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

constexpr double kAll = std::numeric_limits<double>::infinity();
constexpr std::size_t kPartNodes = std::tuple_size_v<BlockPoints>;

/// A box at the line of a line cell, or off it, and a cubic of the place in a frame of its own.
struct BoundCase {
  LimitEvaluator& evaluator;
  LimitCellId cell;
  ParamBox box;
  VoxelFrame frame;
  CubicPolynomial cubic;
  std::array<BlockValues, 3> places;
  BlockValues errors;

  BoundCase(LimitEvaluator& limit, LimitCellId number, const ParamBox& part, std::mt19937& random, double bent)
      : evaluator(limit), cell(number), box(part) {
    Box3 bounds;
    for (std::size_t n = 0; n < kPartNodes; ++n) bounds.extend(sample(node(n)).first);
    frame = VoxelFrame::of(bounds.min(), bounds.max());
    std::uniform_real_distribution<double> u(-1, 1);
    for (std::size_t t = 0; t < kCubicTerms; ++t) cubic[t] = (t <= 2 || t == 10 ? 1 : bent) * u(random);
    for (std::size_t slot = 0; slot < kBlockSlots; ++slot) {
      const auto [position, channel] = sample(at_slot(block_shares(), slot));
      const Vec3 place = frame(position);
      for (std::size_t a = 0; a < 3; ++a) places[a][slot / kLanes][slot % kLanes] = place[static_cast<Eigen::Index>(a)];
      errors[slot / kLanes][slot % kLanes] = channel - value_at(cubic, place);
    }
  }

  static Vec3 node(std::size_t n) {
    return Vec3(n % kBlockNodes, n / kBlockNodes % kBlockNodes, n / kBlockNodes / kBlockNodes) / 4;
  }
  std::pair<Vec3, double> sample(const Vec3& share) const {
    std::vector<double> channels(evaluator.solid().channel_count());
    const Vec3 position = evaluator.geo_and_mat({cell, box.low + share.cwiseProduct(box.high - box.low)}, channels);
    return {position, channels[0]};
  }
  double error(const Vec3& share) const {
    const auto [position, channel] = sample(share);
    return channel - value_at(cubic, frame(position));
  }
};

/// In [0,1], often near an end.
Vec3 random_place(std::mt19937& random) {
  std::uniform_real_distribution<double> u(0, 1);
  Vec3 share;
  for (double& s : share) {
    s = std::ldexp(u(random), -std::uniform_int_distribution<int>(0, 10)(random));
    if (u(random) < 0.5) s = 1 - s;
  }
  return share;
}

double bound_of(const BoundCase& c, const BlockResiduals& residuals) {
  BlockBound bound;
  bound.set_places(c.places, 0, PlaceDegree::kFour);
  ResidualBound residual_bound;
  residual_bound.set_block(c.places, residuals, c.frame.scale.asDiagonal());
  const double left = residual_bound(c.cubic, residuals.values[0], kAll);
  return left + bound(c.cubic, c.errors, kAll);
}

// Of extraordinary edges, and of smooth and sharp boundary edges with one cell or many.
TEST(ResidualBound, NothingBetweenTheNodesIsLarger) {
  std::mt19937 random(6);
  const ParamBox whole, octant{Vec3::Zero(), Vec3::Constant(0.5)}, slab{Vec3(0, 0.5, 0), Vec3(1, 1, 1)},
      far{Vec3::Constant(0.5), Vec3::Ones()}, off{Vec3(0.5, 0, 0), Vec3(1, 0.5, 0.25)};
  std::size_t cases = 0, near = 0;
  for (const auto& [name, mesh] : oracle::tiny_meshes()) {
    SCOPED_TRACE(name);
    const auto solid = prepare_solid(mesh);
    if (solid->channel_count() == 0) continue;
    LimitEvaluator evaluator(*solid);
    LineResiduals line_residuals(solid->data(), {0});
    BlockResiduals residuals;
    std::size_t of_mesh = 0;
    for (LimitCellId cell; cell < solid->cell_count() && of_mesh < 4; cell += 1) {
      if (solid->cell_class(cell) != CellClass::kLine) continue;
      ++of_mesh;
      for (const ParamBox& box : {whole, octant, slab, far, off}) {
        for (const double bent : {0.0, 0.01, 0.3}) {
          const BoundCase c(evaluator, cell, box, random, bent);
          if (!line_residuals.find(cell, box, residuals)) continue;
          const double bound = bound_of(c, residuals);
          double largest = 0;
          for (int n = 0; n < 100; ++n) largest = std::max(largest, std::abs(c.error(random_place(random))));
          ASSERT_GE(bound, largest - 1e-12) << "cell " << cell << " bent " << bent;
          ++cases;
          near += bound <= 4 * largest;
        }
      }
    }
  }
  EXPECT_GT(cases, 300u);
  EXPECT_GT(near, cases / 2) << cases;
}

// A channel that is the cubic itself has no error, although interpolation leaves much of both out.
TEST(ResidualBound, IsSmallWhereTheChannelFollowsThePosition) {
  ControlMesh mesh = oracle::tiny_mesh("boundary_edge_4_hexes");
  oracle::grade_by_coordinates(mesh);
  const auto solid = prepare_solid(mesh);
  LimitEvaluator evaluator(*solid);
  LineResiduals line_residuals(solid->data(), {0});
  std::mt19937 random(7);
  std::size_t cases = 0;
  for (const LimitCellId cell : solid->cells()) {
    if (solid->cell_class(cell) != CellClass::kLine) continue;
    BoundCase c(evaluator, cell, {}, random, 0);
    c.cubic.fill(0);
    c.cubic[0] = c.frame.centre.x();
    c.cubic[10] = 1 / c.frame.scale.x();
    BlockResiduals residuals;
    ASSERT_TRUE(line_residuals.find(cell, {}, residuals));
    ResidualBound bound;
    bound.set_block(c.places, residuals, c.frame.scale.asDiagonal());
    const double without = bound(CubicPolynomial{}, residuals.values[0], kAll);
    EXPECT_GT(without, 1e-4);
    EXPECT_LT(bound(c.cubic, residuals.values[0], kAll), 0.02 * without);  // Channels are floats.
    ++cases;
  }
  EXPECT_GT(cases, 0u);
}

}  // namespace
}  // namespace ccslice
