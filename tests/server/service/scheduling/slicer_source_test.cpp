// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/service/scheduling/slicer_source.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <utility>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice::server {
namespace {

constexpr SlicerMemory kMemory{.shared_bytes = 10, .slicer_bytes = 20};

LayerSlicer small_slicer() {
  const auto solid = prepare_solid(make_box());
  SliceJob job;
  GridRequest grid;
  grid.pitch = {1, 1, 1};
  job.grid = plan_grid(*solid, job.placement, grid);
  job.planes.emplace_back();
  return LayerSlicer(solid, job);
}

class SlicerSourceTest : public ::testing::Test {
 protected:
  std::shared_ptr<SlicerSource> make_source() {
    MemoryBudget::Share reserved(budget_);
    EXPECT_TRUE(reserved.resize(SlicerSource::least_bytes(kMemory)));
    return std::make_shared<SlicerSource>(
        small_slicer(), kMemory, std::move(reserved),
        SlicerSource::Limits{.left_bytes = 15, .is_crowded = [this] { return crowded_.load(); }});
  }

  std::atomic<bool> crowded_ = false;
  MemoryBudget budget_{100};
};

TEST_F(SlicerSourceTest, ReservesEachFurtherSlicerAndGivesItBackWithIt) {
  auto source = make_source();
  const LayerStream::MakeCompute make = source->make();
  const ComputeLimit limit = source->limit();
  source = nullptr;
  EXPECT_EQ(budget_.used_bytes(), 30u);
  std::vector<LayerStream::ComputeLayer> slicers{make({})};
  EXPECT_EQ(budget_.used_bytes(), 30u) << "the first one's part was there";
  EXPECT_EQ(slicers.front()(3, {}).index, 3u);
  for (const std::uint64_t used : {50u, 70u}) {
    ASSERT_TRUE(limit.may_add());
    EXPECT_EQ(budget_.used_bytes(), used) << "before it is made";
    slicers.push_back(make({}));
    EXPECT_EQ(budget_.used_bytes(), used);
  }
  EXPECT_FALSE(limit.may_add()) << "what is left is for others";
  slicers.pop_back();
  EXPECT_EQ(budget_.used_bytes(), 50u);
  crowded_ = true;
  EXPECT_TRUE(limit.is_crowded());
  EXPECT_FALSE(limit.may_add()) << "others wait for it";
  slicers.pop_back();
  slicers.pop_back();
  EXPECT_EQ(budget_.used_bytes(), 30u) << "the next one finds its part";
  slicers.push_back(make({}));
  EXPECT_EQ(budget_.used_bytes(), 30u);
}

TEST_F(SlicerSourceTest, GivesAllBackWithTheLastSlicer) {
  LayerStream::ComputeLayer slicer;
  {
    const auto source = make_source();
    ASSERT_TRUE(source->limit().may_add());
    slicer = source->make()({});
  }
  EXPECT_GE(budget_.used_bytes(), 30u);
  slicer = nullptr;
  EXPECT_EQ(budget_.used_bytes(), 0u);
}

}  // namespace
}  // namespace ccslice::server
