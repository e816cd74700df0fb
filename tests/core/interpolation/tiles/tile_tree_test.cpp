// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_tree.h"

#include <gtest/gtest.h>

#include <vector>

#include "core/job/slice_job.h"

namespace ccslice {
namespace {

using NodeKind = TileTree::Node::Kind;

Grid grid_of(std::uint32_t columns, std::uint32_t rows, double pitch_mm) {
  Grid grid;
  grid.pitch = {pitch_mm, pitch_mm, pitch_mm};
  grid.extent = {columns, rows, 64};
  return grid;
}

/// What a run met: kinds of leaves and columns.
struct Met {
  NodeKind kind;
  std::uint32_t index, row, begin, end;
  bool operator==(const Met&) const = default;
};

std::vector<Met> leaves_of(const TileTree& tree, std::uint32_t layer, const VoxelRun& run) {
  std::vector<Met> met;
  tree.visit_leaves(layer, run, [&](const TileTree::Node& leaf, const VoxelRun& part) {
    met.push_back({leaf.kind, leaf.index, part.row, part.begin, part.end});
  });
  return met;
}

std::vector<CubicPolynomial> constant(double value) {
  CubicPolynomial polynomial{};
  polynomial[0] = value;
  return {polynomial};
}

TEST(TileTree, CutsAGridIntoTilesThatCoverIt) {
  TileTree tree(grid_of(300, 70, 0.05), 1);
  tree.clear(32);
  EXPECT_EQ(tree.tile_size(), (TileTree::Voxel{128, 64, kSlabLayers}));  // 11.2 mm hold 128 columns, not 256.
  EXPECT_EQ(tree.tile_columns(), 3u);
  EXPECT_EQ(tree.tile_rows(), 2u);
  EXPECT_EQ(tree.tile_box(2, 1).low, (TileTree::Voxel{256, 64, 32}));
  EXPECT_EQ(tree.tile_box(2, 1).high, (TileTree::Voxel{384, 128, 48}));
}

TEST(TileTree, TilesAreNotLongerThanElevenMillimetresAndABit) {
  EXPECT_EQ(TileTree(grid_of(8, 8, 1), 1).tile_size(), (TileTree::Voxel{8, 8, kSlabLayers}));
  EXPECT_EQ(TileTree(grid_of(8, 8, 100), 1).tile_size(), (TileTree::Voxel{1, 1, kSlabLayers}));
  EXPECT_EQ(TileTree(grid_of(8, 8, 1e-3), 1).tile_size(), (TileTree::Voxel{256, 64, kSlabLayers}));
}

TEST(TileTree, IsEmptyUntilTilesAreSet) {
  TileTree tree(grid_of(300, 70, 0.05), 1);
  tree.clear(0);
  EXPECT_TRUE(leaves_of(tree, 3, {5, 0, 300}).empty());
  EXPECT_FALSE(tree.cubics_at({10, 5, 3}));
}

// Tile 0 is split along columns and layers: one quarter is a polynomial, one is inverted, one is split along rows
// again.
class SplitTile : public testing::Test {
 protected:
  SplitTile() : tree_(grid_of(300, 70, 0.05), 1) {
    tree_.clear(16);
    const TileTree::Node split = tree_.add_split(0b101);
    const VoxelFrame frame = VoxelFrame::of(Vec3(0, 0, 16), Vec3(63, 63, 23));
    tree_.set_child(split, 0b000, tree_.add_polynomials(frame, constant(7)));
    tree_.set_child(split, 0b001, tree_.add_exact(CellParam{LimitCellId{42}, Vec3::Zero()}));
    const TileTree::Node rows = tree_.add_split(0b010);
    tree_.set_child(rows, 0b000, tree_.add_exact({}));
    tree_.set_child(rows, 0b010, tree_.add_polynomials(frame, constant(8)));
    tree_.set_child(split, 0b101, rows);
    tree_.set_tile(0, 0, split);
    tree_.set_tile(1, 0, tree_.add_polynomials(frame, constant(9)));
  }

  TileTree tree_;
};

TEST_F(SplitTile, RunsMeetTheLeavesInOrderOfColumns) {
  EXPECT_EQ(leaves_of(tree_, 17, {5, 3, 200}), (std::vector<Met>{{NodeKind::kPolynomial, 0, 5, 3, 64},
                                                                 {NodeKind::kExact, 0, 5, 64, 128},
                                                                 {NodeKind::kPolynomial, 2, 5, 128, 200}}));
}

TEST_F(SplitTile, EmptyLeavesAreLeftOut) {
  EXPECT_EQ(leaves_of(tree_, 24, {5, 3, 130}),
            (std::vector<Met>{{NodeKind::kExact, 1, 5, 64, 128}, {NodeKind::kPolynomial, 2, 5, 128, 130}}));
}

TEST_F(SplitTile, RunsThatEndAtALeavesEdgeStayInIt) {
  EXPECT_EQ(leaves_of(tree_, 17, {5, 63, 64}), (std::vector<Met>{{NodeKind::kPolynomial, 0, 5, 63, 64}}));
  EXPECT_EQ(leaves_of(tree_, 17, {5, 64, 65}), (std::vector<Met>{{NodeKind::kExact, 0, 5, 64, 65}}));
}

TEST_F(SplitTile, AVoxelsCubicsAreThoseOfItsLeaf) {
  ASSERT_TRUE(tree_.cubics_at({63, 63, 23}));
  EXPECT_EQ(tree_.cubics_at({63, 63, 23})->polynomials[0][0], 7);
  EXPECT_FALSE(tree_.cubics_at({64, 63, 23})) << "inverted";
  EXPECT_FALSE(tree_.cubics_at({63, 63, 24})) << "empty";
  EXPECT_FALSE(tree_.cubics_at({64, 31, 24})) << "inverted";
  EXPECT_EQ(tree_.cubics_at({64, 32, 24})->polynomials[0][0], 8);
  EXPECT_EQ(tree_.cubics_at({128, 0, 16})->polynomials[0][0], 9);
}

TEST_F(SplitTile, LeavesKeepTheirHints) {
  ASSERT_TRUE(tree_.hint(0));
  EXPECT_EQ(tree_.hint(0)->cell, 42u);
  EXPECT_FALSE(tree_.hint(1));
}

TEST_F(SplitTile, ClearingForgetsAllAndMovesToAnotherSlab) {
  tree_.clear(48);
  EXPECT_TRUE(leaves_of(tree_, 49, {5, 0, 300}).empty());
  EXPECT_EQ(tree_.tile_box(0, 0).low[2], 48u);
}

}  // namespace
}  // namespace ccslice
