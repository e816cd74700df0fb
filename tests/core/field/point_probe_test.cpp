// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/point_probe.h"

#include <gtest/gtest.h>

#include <map>
#include <optional>
#include <random>
#include <vector>

#include "core/base/error.h"
#include "core/field/material_field.h"
#include "core/limit/limit_evaluator.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice {
namespace {

constexpr unsigned kProbeSeed = 5;
constexpr double kProbeOutsideMm = 2e-3;

struct FoundPoint {
  CellParam at;
  double residual_mm, largest_residual_mm;
  std::vector<double> channels;

  bool operator==(const FoundPoint& other) const {
    return at.cell == other.at.cell && at.uvw == other.at.uvw && residual_mm == other.residual_mm &&
           largest_residual_mm == other.largest_residual_mm && channels == other.channels;
  }
};

std::map<std::size_t, FoundPoint> probe_all(PointProbe& probe, std::span<const Vec3> points) {
  std::map<std::size_t, FoundPoint> found;
  probe.probe(points,
              [&](std::size_t point, const ProbedPoint& p) {
                EXPECT_FALSE(found.contains(point));
                found[point] = {p.at, p.residual_mm, p.largest_residual_mm, {p.channels.begin(), p.channels.end()}};
              },
              {});
  return found;
}

class PointProbeTest : public testing::Test {
 protected:
  /// All over the part's box and a little beyond, and some beside its boundary.
  std::vector<Vec3> points(std::size_t count) const {
    std::mt19937 random(kProbeSeed);
    std::uniform_real_distribution<double> share(-0.02, 1.02);
    std::vector<Vec3> result;
    const Box3& box = solid_->summary().bounding_box;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 shares(share(random), share(random), share(random));
      result.push_back(placement_ * (box.min() + shares.cwiseProduct(box.sizes())).eval());
    }
    return result;
  }

  std::shared_ptr<const LimitSolid> solid_ = prepare_solid(make_engine());
  const Placement placement_ =
      Placement(Eigen::Translation3d(3, -20, 7) * Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()) *
                Eigen::Scaling(1.0, 1.5, 0.8));
};

TEST_F(PointProbeTest, FindsWhatAFieldInvertsWithoutAHint) {
  const std::vector<Vec3> world = points(4096);
  PointProbe probe(solid_, placement_, kProbeOutsideMm);
  const std::map<std::size_t, FoundPoint> found = probe_all(probe, world);
  const auto field = make_material_field(solid_, placement_, kProbeOutsideMm);
  LimitEvaluator evaluator(*solid_);
  std::vector<double> channels(solid_->channel_count());
  for (std::size_t p = 0; p < world.size(); ++p) {
    const auto expected = field->invert(world[p], {});
    const auto it = found.find(p);
    ASSERT_EQ(it != found.end(), expected.has_value()) << "seed " << kProbeSeed << ", point " << p;
    if (!expected) continue;
    EXPECT_EQ(it->second.at.cell, expected->at.cell);
    EXPECT_EQ(it->second.at.uvw, expected->at.uvw);
    EXPECT_EQ(it->second.largest_residual_mm, expected->residual_mm);
    EXPECT_EQ(it->second.residual_mm, (placement_ * evaluator.geo(expected->at) - world[p]).norm());
    field->mat(expected->at, channels);
    EXPECT_EQ(it->second.channels, channels);
  }
  EXPECT_GT(found.size(), 500u);
  EXPECT_LT(found.size(), 3000u);
}

TEST_F(PointProbeTest, AnswersDependOnTheirPointAlone) {
  std::vector<Vec3> world = points(1000);
  PointProbe probe(solid_, placement_, kProbeOutsideMm);
  const std::map<std::size_t, FoundPoint> together = probe_all(probe, world);
  for (std::size_t p = 0; p < world.size(); p += 7) {
    PointProbe fresh(solid_, placement_, kProbeOutsideMm);
    const std::map<std::size_t, FoundPoint> alone = probe_all(fresh, std::span(world).subspan(p, 1));
    ASSERT_EQ(alone.empty(), !together.contains(p));
    if (!alone.empty()) {
      EXPECT_TRUE(alone.at(0) == together.at(p)) << p;
    }
  }
  std::ranges::reverse(world);
  const std::map<std::size_t, FoundPoint> reversed = probe_all(probe, world);
  ASSERT_EQ(reversed.size(), together.size());
  for (const auto& [point, found] : reversed) EXPECT_TRUE(together.at(world.size() - 1 - point) == found) << point;
}

TEST_F(PointProbeTest, StopsWhenCancelled) {
  const CancellationToken cancel = CancellationToken::make();
  PointProbe probe(solid_, placement_, kProbeOutsideMm);
  const std::vector<Vec3> world = points(1000);
  int found = 0;
  const auto count_and_cancel = [&](std::size_t, const ProbedPoint&) {
    ++found;
    cancel.cancel();
  };
  EXPECT_THROW(probe.probe(world, count_and_cancel, cancel), Error);
  EXPECT_EQ(found, 1);
  EXPECT_FALSE(probe_all(probe, world).empty()) << "and goes on afterwards";
}

}  // namespace
}  // namespace ccslice
