// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/samples/block_stencils.h"

#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice {
namespace {

/// Limits of four numbers for one block, whatever they are.
std::vector<double> numbers(const LimitStencils& stencils) {
  std::vector<Lanes> points;
  for (std::size_t p = 0; p < stencils.points(); ++p) {
    const double x = static_cast<double>(p * p % 17), y = static_cast<double>(p % 5);
    points.push_back(Lanes{x, y, x - y, 1});
  }
  std::vector<double> numbers;
  stencils.apply(points.data(), [&](std::size_t, const auto& first, const auto& last) {
    for (std::size_t d = 0; d < kLanes; ++d) {
      for (std::size_t lane = 0; lane < kLanes; ++lane) numbers.insert(numbers.end(), {first[d][lane], last[d][lane]});
    }
  });
  return numbers;
}

class StencilsOfABracket : public testing::Test {
 protected:
  static void SetUpTestSuite() { solid_ = prepare_solid(make_bracket()); }
  static void TearDownTestSuite() { solid_.reset(); }

  /// Irregular cells by class, operator and phantoms.
  static auto neighbourhoods() {
    std::map<std::tuple<CellClass, std::uint32_t, PhantomMask>, std::vector<const LimitCell*>> result;
    for (const LimitCell& cell : solid_->data().cells) {
      if (cell.cell_class == CellClass::kRegular) continue;
      result[{cell.cell_class, cell.op, cell.phantoms}].push_back(&cell);
    }
    return result;
  }

  static std::shared_ptr<const LimitSolid> solid_;
};
std::shared_ptr<const LimitSolid> StencilsOfABracket::solid_;

TEST_F(StencilsOfABracket, AreWorthItForLargeBoxesOfFrequentNeighbourhoods) {
  const BlockStencils stencils(solid_->data());
  const ParamBox whole, quarter{Vec3(0.25, 0, 0.5), Vec3(0.5, 1, 0.75)}, eighth{Vec3(0, 0, 0), Vec3(1, 0.125, 1)};
  std::size_t frequent = 0, rare = 0;
  for (const auto& [key, cells] : neighbourhoods()) {
    const bool worth = cells.size() >= 32;
    ++(worth ? frequent : rare);
    EXPECT_EQ(stencils.are_worth_it(*cells.front(), whole), worth);
    EXPECT_EQ(stencils.are_worth_it(*cells.back(), quarter), worth);
    EXPECT_FALSE(stencils.are_worth_it(*cells.front(), eighth));
  }
  EXPECT_GT(frequent, 0u);
  EXPECT_GT(rare, 0u);
}

TEST_F(StencilsOfABracket, AreSharedByCellsOfANeighbourhoodWhateverTheirFrames) {
  BlockStencils stencils(solid_->data());
  std::size_t different_frames = 0;
  for (const auto& [key, cells] : neighbourhoods()) {
    const std::shared_ptr<const LimitStencils> first = stencils.at(*cells.front(), {}, BlockPlaces::kNodes);
    EXPECT_EQ(first->points(), solid_->data().point_count(*cells.front()));
    const std::vector<double> expected = numbers(*first);
    const std::size_t bytes = stencils.memory_bytes();
    EXPECT_EQ(numbers(*stencils.at(*cells.back(), {}, BlockPlaces::kNodes)), expected);
    EXPECT_EQ(stencils.memory_bytes(), bytes);
    EXPECT_NE(numbers(*stencils.at(*cells.back(), {}, BlockPlaces::kBetweenNodes)), expected);
    EXPECT_GT(stencils.memory_bytes(), bytes);
    different_frames += cells.front()->frame != cells.back()->frame;
  }
  EXPECT_GT(different_frames, 0u);
}

// Small boxes of one cell, until all are forgotten twice.
TEST_F(StencilsOfABracket, AreTheSameWhenTheyAreMadeAgain) {
  BlockStencils stencils(solid_->data());
  const LimitCell& cell = *neighbourhoods().begin()->second.front();
  const std::vector<double> before = numbers(*stencils.at(cell, {}, BlockPlaces::kNodes));
  int forgotten = 0;
  for (int n = 0; forgotten < 2 && n < 64 * 64; ++n) {
    const std::size_t bytes = stencils.memory_bytes();
    const Vec3 low(n % 8 / 8.0, n / 8 % 8 / 8.0, n / 64 / 64.0);
    (void)stencils.at(cell, {low, low + Vec3::Constant(1.0 / 64)}, BlockPlaces::kNodes);
    forgotten += stencils.memory_bytes() < bytes;
    ASSERT_LE(stencils.memory_bytes(), std::size_t{16} << 20);
  }
  ASSERT_EQ(forgotten, 2);
  EXPECT_EQ(numbers(*stencils.at(cell, {}, BlockPlaces::kNodes)), before);
}

// Two are asked for again and again while others come: they stay, and one that wasn't asked for goes.
TEST_F(StencilsOfABracket, ThoseAskedForLongestAgoAreForgottenFirst) {
  const LimitCell& cell = *neighbourhoods().begin()->second.front();
  const auto box_at = [](int n) {
    const Vec3 low(n % 8 / 8.0, n / 8 % 8 / 8.0, 0);
    return ParamBox{low, low + Vec3::Constant(1.0 / 64)};
  };
  const auto bytes_of_one = BlockStencils(solid_->data()).at(cell, box_at(0), BlockPlaces::kNodes)->memory_bytes();
  BlockStencils stencils(solid_->data(), 16 * bytes_of_one);
  const auto first = stencils.at(cell, box_at(0), BlockPlaces::kNodes),
             second = stencils.at(cell, box_at(1), BlockPlaces::kNodes),
             other = stencils.at(cell, box_at(2), BlockPlaces::kNodes);
  for (int n = 3; n < 40; ++n) {
    (void)stencils.at(cell, box_at(n), BlockPlaces::kNodes);
    EXPECT_EQ(stencils.at(cell, box_at(0), BlockPlaces::kNodes), first);
    EXPECT_EQ(stencils.at(cell, box_at(1), BlockPlaces::kNodes), second);
    EXPECT_LE(stencils.memory_bytes(), 16 * bytes_of_one);
  }
  const auto again = stencils.at(cell, box_at(2), BlockPlaces::kNodes);
  EXPECT_NE(again, other);
  EXPECT_EQ(numbers(*again), numbers(*other));
}

TEST_F(StencilsOfABracket, AreTheSameForManyThreads) {
  const LimitCell& cell = *neighbourhoods().begin()->second.front();
  const auto box_at = [](int n) { return ParamBox{Vec3(n / 16.0, 0, 0), Vec3((n + 1) / 16.0, 1, 1)}; };
  std::vector<std::vector<double>> alone;
  for (int n = 0; n < 16; ++n) {
    alone.push_back(numbers(*BlockStencils(solid_->data()).at(cell, box_at(n), BlockPlaces::kNodes)));
  }
  BlockStencils shared(solid_->data(), 4 << 16);
  std::vector<std::thread> threads;
  std::atomic<int> different = 0;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int n = 0; n < 64; ++n) {
        const int box = (5 * n + t) % 16;
        const auto found = shared.at(cell, box_at(box), BlockPlaces::kNodes);
        different += numbers(*found) != alone[static_cast<std::size_t>(box)];
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(different, 0);
}

}  // namespace
}  // namespace ccslice
