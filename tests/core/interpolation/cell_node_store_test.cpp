// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/cell_node_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "core/mesh/models.h"
#include "tests/core/interpolation/found_pieces.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

const Box3 kBounds(Vec3::Zero(), Vec3::Ones());

TEST(CellNodeStore, KeepsCellsAsTheyAreLeft) {
  CellNodeStore store(1 << 20);
  const std::shared_ptr<CellNodes> nodes = store.nodes_of(7, kBounds);
  ASSERT_EQ(nodes->nodes.size(), 1u);
  EXPECT_EQ(nodes->nodes[0].kind, CellNode::Kind::kUnknown);
  EXPECT_EQ(nodes->nodes[0].bounds.max(), kBounds.max());
  EXPECT_EQ(store.nodes_of(7, kBounds), nodes);
  EXPECT_NE(store.nodes_of(8, kBounds), nodes);
}

TEST(CellNodeStore, ForgetsTheCellsAskedForLongestAgo) {
  const std::size_t one = [] {
    CellNodeStore store(1 << 20);
    (void)store.nodes_of(0, kBounds);
    return store.memory_bytes();
  }();
  CellNodeStore store(3 * one);
  const std::shared_ptr<CellNodes> first = store.nodes_of(1, kBounds), second = store.nodes_of(2, kBounds);
  (void)store.nodes_of(3, kBounds);
  EXPECT_EQ(store.nodes_of(1, kBounds), first);
  (void)store.nodes_of(4, kBounds);
  EXPECT_EQ(store.memory_bytes(), 3 * one);
  EXPECT_EQ(store.nodes_of(1, kBounds), first);
  EXPECT_NE(store.nodes_of(2, kBounds), second);
}

TEST(CellNodeStore, CountsWhatIsAddedToTheCellsThatItKeeps) {
  CellNodeStore store(1 << 20);
  const std::shared_ptr<CellNodes> nodes = store.nodes_of(1, kBounds);
  const std::size_t before = store.memory_bytes();
  nodes->nodes.resize(100);
  store.set_memory(1, *nodes);
  EXPECT_GE(store.memory_bytes(), before + 90 * sizeof(CellNode));
  CellNodes other;
  store.set_memory(1, other);
  store.set_memory(2, other);
  EXPECT_GE(store.memory_bytes(), before + 90 * sizeof(CellNode));
}

/// Slabs of a bracket: what its pieces are and which voxels they hold.
class SharedPieces : public testing::Test {
 protected:
  struct Slab {
    std::vector<std::uint32_t> runs;
    std::vector<double> coefficients;
    std::vector<bool> holes;  // Of some voxels: in any, in a large one, in small ones alone.
    bool operator==(const Slab&) const = default;
  };

  SharedPieces() : solid_(LimitSolid::prepare(make_bracket())), job_(job_of(solid_, {0.2, 0.2, 0.06})) {}

  std::uint32_t slabs() const { return (job_.grid.extent.layers + kSlabLayers - 1) / kSlabLayers; }

  FoundPieces worker(std::shared_ptr<CellNodeStore> store) const {
    return FoundPieces(solid_, {job_.placement, job_.grid, {{0, 1e-3}}, kOutsideMm}, std::move(store));
  }

  Slab slab(FoundPieces& pieces, std::uint32_t index) const {
    const std::uint32_t first = index * kSlabLayers, end = std::min(first + kSlabLayers, job_.grid.extent.layers);
    pieces.start(first, end);
    for (std::uint32_t layer = first; layer < end; ++layer) pieces.find(layer, {});
    return slab_found(pieces, first, end);
  }

  Slab slab_found(const SlabPieces& pieces, std::uint32_t first, std::uint32_t end) const {
    Slab result;
    for (std::uint32_t layer = first; layer < end; ++layer) {
      for (std::uint32_t row = 0; row < job_.grid.extent.rows; row += 2) {
        for (std::uint32_t column = 0; column < job_.grid.extent.columns; column += 3) {
          const Vec3 voxel(column, row, layer);
          result.holes.insert(result.holes.end(), {pieces.is_in_hole(voxel), pieces.is_in_large_hole(voxel),
                                                   pieces.parameter_in_hole(voxel).has_value()});
        }
      }
      for (const PieceRun& run : pieces.runs(layer)) {
        result.runs.insert(result.runs.end(), {layer, run.row, run.begin, run.end});
        const CubicPolynomial& polynomial = pieces.polynomials(run.piece)[0];
        result.coefficients.insert(result.coefficients.end(), polynomial.begin(), polynomial.end());
      }
    }
    return result;
  }

  Solid solid_;
  SliceJob job_;
};

TEST_F(SharedPieces, AreTheSameWhateverTheStoreHolds) {
  FoundPieces forgetful = worker(std::make_shared<CellNodeStore>(1)), keeping = worker(make_cell_node_store());
  std::vector<Slab> alone;
  for (std::uint32_t s = 0; s < slabs(); ++s) alone.push_back(slab(forgetful, s));
  for (std::uint32_t s = 0; s < slabs(); ++s) EXPECT_EQ(slab(keeping, s), alone[s]) << s;
  for (std::uint32_t s = slabs(); s-- > 0;) EXPECT_EQ(slab(keeping, s), alone[s]) << s;
  FoundPieces downwards = worker(make_cell_node_store());
  for (std::uint32_t s = slabs(); s-- > 0;) EXPECT_EQ(slab(downwards, s), alone[s]) << s;
}

// The first layers of a worker's first slab are found a few at a time, from whichever is asked for first.
TEST_F(SharedPieces, AreTheSameInWhateverOrderLayersAreFound) {
  FoundPieces whole = worker(make_cell_node_store());
  slab(whole, 0);
  const Slab expected = slab(whole, 1);  // At once.
  for (const std::vector<std::uint32_t>& order :
       {std::vector<std::uint32_t>{0, 5, 2}, std::vector<std::uint32_t>{15, 7, 9}, std::vector<std::uint32_t>{}}) {
    FoundPieces pieces = worker(make_cell_node_store());
    pieces.start(kSlabLayers, 2 * kSlabLayers);
    for (const std::uint32_t layer : order) pieces.find(kSlabLayers + layer, {});
    for (std::uint32_t layer = kSlabLayers; layer < 2 * kSlabLayers; ++layer) pieces.find(layer, {});
    EXPECT_EQ(slab_found(pieces, kSlabLayers, 2 * kSlabLayers), expected);
  }
}

TEST_F(SharedPieces, AreTheSameAfterACancelledSearch) {
  const std::shared_ptr<CellNodeStore> store = make_cell_node_store();
  FoundPieces other = worker(store), pieces = worker(store);
  const Slab expected = slab(other, 0);
  const CancellationToken token = CancellationToken::make();
  token.cancel();
  pieces.start(0, kSlabLayers);
  pieces.find(3, {});
  EXPECT_THROW(pieces.find(9, token), Error);  // All nodes are known: cancelled between finding and scanning pieces.
  for (std::uint32_t layer = 0; layer < kSlabLayers; ++layer) pieces.find(layer, {});
  EXPECT_EQ(slab_found(pieces, 0, kSlabLayers), expected);
}

TEST_F(SharedPieces, AreTheSameForAWorkerThatIsMoved) {
  FoundPieces here = worker(make_cell_node_store()), other = worker(make_cell_node_store());
  slab(here, 0);
  FoundPieces there(std::move(here));
  const Slab found = slab(there, 2);
  EXPECT_FALSE(found.runs.empty());
  EXPECT_EQ(found, slab(other, 2));
}

TEST_F(SharedPieces, AreTheSameForWorkersAtOnce) {
  FoundPieces alone = worker(make_cell_node_store());
  const std::shared_ptr<CellNodeStore> store = make_cell_node_store();
  std::vector<Slab> slabs_found(slabs());
  std::vector<std::thread> threads;
  for (std::uint32_t t = 0; t < 3; ++t) {
    threads.emplace_back([&, t] {
      FoundPieces pieces = worker(store);
      for (std::uint32_t s = t; s < slabs(); s += 3) slabs_found[s] = slab(pieces, s);
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (std::uint32_t s = 0; s < slabs(); ++s) EXPECT_EQ(slabs_found[s], slab(alone, s)) << s;
}

}  // namespace
}  // namespace ccslice
