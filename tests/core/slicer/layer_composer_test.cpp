// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_composer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <tuple>
#include <vector>

#include "core/job/validate_job.h"
#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "core/slicer/layer_slicer.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using Own = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>;                   // Row, begin, end.
using Owned = std::tuple<std::uint32_t, std::uint32_t, std::uint32_t, std::uint32_t>;  // And the part.

struct Added {
  std::vector<Own> own;
  std::vector<Owned> covered;
};

Added add(VoxelOwners& owners, std::uint32_t part, const std::vector<VoxelRun>& spans) {
  Added added;
  const auto own = owners.add(
      part, spans, [&](const OwnedRun& run) { added.covered.emplace_back(run.row, run.begin, run.end, run.part); });
  for (const VoxelRun& run : own) added.own.emplace_back(run.row, run.begin, run.end);
  return added;
}

std::vector<Owned> runs_of(const VoxelOwners& owners) {
  std::vector<Owned> runs;
  for (const OwnedRun& run : owners.runs()) runs.emplace_back(run.row, run.begin, run.end, run.part);
  return runs;
}

TEST(VoxelOwners, GiveAPartWhatNoOtherOneHas) {
  VoxelOwners owners;
  EXPECT_THAT(add(owners, 0, {{2, 10, 20}, {2, 30, 40}}).own, ElementsAre(Own(2, 10, 20), Own(2, 30, 40)));
  const Added second = add(owners, 1, {{1, 0, 5}, {2, 5, 12}, {2, 15, 32}, {2, 38, 39}, {3, 10, 20}});
  EXPECT_THAT(second.own, ElementsAre(Own(1, 0, 5), Own(2, 5, 10), Own(2, 20, 30), Own(3, 10, 20)));
  EXPECT_THAT(second.covered,
              ElementsAre(Owned(2, 10, 12, 0), Owned(2, 15, 20, 0), Owned(2, 30, 32, 0), Owned(2, 38, 39, 0)));
  EXPECT_THAT(runs_of(owners), ElementsAre(Owned(1, 0, 5, 1), Owned(2, 5, 10, 1), Owned(2, 10, 20, 0),
                                           Owned(2, 20, 30, 1), Owned(2, 30, 40, 0), Owned(3, 10, 20, 1)));
}

TEST(VoxelOwners, GiveNothingOfWhatIsCoveredAsAWhole) {
  VoxelOwners owners;
  add(owners, 3, {{0, 0, 100}});
  const Added within = add(owners, 1, {{0, 5, 6}, {0, 50, 60}, {0, 99, 100}});
  EXPECT_THAT(within.own, IsEmpty());
  EXPECT_THAT(within.covered, ElementsAre(Owned(0, 5, 6, 3), Owned(0, 50, 60, 3), Owned(0, 99, 100, 3)));
  const Added around = add(owners, 0, {{0, 0, 101}});
  EXPECT_THAT(around.own, ElementsAre(Own(0, 100, 101)));
  EXPECT_THAT(runs_of(owners), ElementsAre(Owned(0, 0, 100, 3), Owned(0, 100, 101, 0)));
}

TEST(VoxelOwners, ForgetLayers) {
  VoxelOwners owners;
  add(owners, 0, {{0, 0, 9}});
  owners.clear();
  EXPECT_THAT(owners.runs(), IsEmpty());
  EXPECT_THAT(add(owners, 1, {{0, 0, 9}}).own, ElementsAre(Own(0, 0, 9)));
}

Placement moved_by(double x_mm) {
  Placement placement = Placement::Identity();
  placement.translate(Vec3(x_mm, 0, 0));
  return placement;
}

/// Boxes of 24 x 16 x 8 mm in one row, in voxels of 1 mm.
PlacedParts boxes_at(const std::vector<double>& places, const std::vector<std::int32_t>& priorities) {
  const Solid solid = prepare_solid(make_box());
  PlacedParts parts;
  for (std::size_t p = 0; p < places.size(); ++p) {
    SliceJob job;
    job.placement = moved_by(places[p]);
    GridRequest request;
    request.pitch = {1, 1, 1};
    request.origin_mm = Vec3::Zero();
    request.extent = GridExtent{60, 16, 8};
    job.grid = plan_grid(*solid, job.placement, request);
    job.planes = {occupancy(), channel(solid, 0, SampleType::kFloat32)};
    job.contours = true;
    parts.push_back({"box " + std::to_string(p), solid, job, priorities[p]});
  }
  return parts;
}

float value_at(const Layer& layer, std::uint32_t x) {
  float value;
  std::memcpy(&value, &layer.planes[1].bytes[4 * x], sizeof value);
  return value;
}

TEST(LayerComposer, GivesVoxelsOfSeveralPartsToTheHighestPriorityAndThenToTheFirst) {
  // Columns 0 to 23, 12 to 35 and 30 to 53; the gradient runs from 0 to 1 in each.
  const auto middle_of = [](double begin, std::uint32_t x) { return static_cast<float>((x + 0.5 - begin) / 24); };
  const Layer last_first = LayerSlicer(boxes_at({0, 12, 30}, {0, 0, 5})).slice(3, {});
  EXPECT_EQ(last_first.stats.voxels_inside, 54u * 16);
  EXPECT_EQ(last_first.stats.voxels_covered, (12u + 6u) * 16);
  EXPECT_NEAR(value_at(last_first, 15), middle_of(0, 15), 1e-4);
  EXPECT_NEAR(value_at(last_first, 25), middle_of(12, 25), 1e-4);
  EXPECT_NEAR(value_at(last_first, 32), middle_of(30, 32), 1e-4);
  EXPECT_EQ(value_at(last_first, 55), 0);
  const Layer second_first = LayerSlicer(boxes_at({0, 12, 30}, {-1, 7, 5})).slice(3, {});
  EXPECT_NEAR(value_at(second_first, 15), middle_of(12, 15), 1e-4);
  EXPECT_NEAR(value_at(second_first, 32), middle_of(12, 32), 1e-4);
  EXPECT_NEAR(value_at(second_first, 40), middle_of(30, 40), 1e-4);
}

TEST(LayerComposer, NamesThePartOfEachContour) {
  const Layer layer = LayerSlicer(boxes_at({0, 30, 12}, {0, 0, 0})).slice(3, {});
  ASSERT_EQ(layer.contours.loops.size(), 3u);
  EXPECT_EQ(layer.stats.contour_loops, 3u);
  for (std::uint32_t part = 0; part < 3; ++part) {
    const ContourLoop& loop = layer.contours.loops[part];
    EXPECT_EQ(loop.part, part);
    const ContourPoint& left = std::ranges::min(loop.points, {}, [](const ContourPoint& p) { return p.xy.x(); });
    const std::array<double, 3> places = {0, 30, 12};
    EXPECT_NEAR(left.xy.x(), places[part], 1e-9);
  }
}

TEST(LayerComposer, LeavesLayersOfAbuttingPartsWithoutCoveredVoxels) {
  const Layer layer = LayerSlicer(boxes_at({0, 24}, {0, 1})).slice(0, {});
  EXPECT_EQ(layer.stats.voxels_inside, 48u * 16);
  EXPECT_EQ(layer.stats.voxels_covered, 0u);
}

}  // namespace
}  // namespace ccslice
