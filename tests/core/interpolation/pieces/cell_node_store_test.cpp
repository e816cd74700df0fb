// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/cell_node_store.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/interpolation/found_pieces.h"
#include "tests/core/slicer/test_jobs.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice {
namespace {

TEST(CellNodeStore, SharesTheRoomOfAJobWithOthersDownToALeast) {
  const NodeStoreBytes alone = bytes_of_store(1), of_four = bytes_of_store(4), of_many = bytes_of_store(1000);
  EXPECT_EQ(of_four.pieces, alone.pieces / 4);
  EXPECT_EQ(of_four.stencils, alone.stencils / 4);
  EXPECT_EQ(of_many.pieces, of_many.stencils);
  EXPECT_GE(of_many.pieces, 1u << 20);
}

const Box3 kCellBounds(Vec3::Zero(), Vec3::Ones());

TEST(CellNodeStore, KeepsCellsAsTheyAreLeft) {
  CellNodeStore store(1 << 20);
  const std::shared_ptr<CellNodes> nodes = store.nodes_of(LimitCellId{7}, kCellBounds);
  ASSERT_EQ(nodes->nodes.size(), 1u);
  EXPECT_EQ(nodes->nodes[0].kind, CellNode::Kind::kUnknown);
  EXPECT_EQ(nodes->nodes[0].bounds.max(), kCellBounds.max());
  EXPECT_EQ(store.nodes_of(LimitCellId{7}, kCellBounds), nodes);
  EXPECT_NE(store.nodes_of(LimitCellId{8}, kCellBounds), nodes);
}

TEST(CellNodeStore, ForgetsTheCellsAskedForLongestAgo) {
  const std::size_t one = [] {
    CellNodeStore store(1 << 20);
    (void)store.nodes_of(LimitCellId{0}, kCellBounds);
    return store.memory_bytes();
  }();
  CellNodeStore store(3 * one);
  const std::shared_ptr<CellNodes> first = store.nodes_of(LimitCellId{1}, kCellBounds),
                                   second = store.nodes_of(LimitCellId{2}, kCellBounds);
  (void)store.nodes_of(LimitCellId{3}, kCellBounds);
  EXPECT_EQ(store.nodes_of(LimitCellId{1}, kCellBounds), first);
  (void)store.nodes_of(LimitCellId{4}, kCellBounds);
  EXPECT_EQ(store.memory_bytes(), 3 * one);
  EXPECT_EQ(store.nodes_of(LimitCellId{1}, kCellBounds), first);
  EXPECT_NE(store.nodes_of(LimitCellId{2}, kCellBounds), second);
}

TEST(CellNodeStore, CountsWhatIsAddedToTheCellsThatItKeeps) {
  CellNodeStore store(1 << 20);
  const std::shared_ptr<CellNodes> nodes = store.nodes_of(LimitCellId{1}, kCellBounds);
  const std::size_t before = store.memory_bytes();
  nodes->nodes.resize(100);
  store.set_memory(LimitCellId{1}, *nodes);
  EXPECT_GE(store.memory_bytes(), before + 90 * sizeof(CellNode));
  CellNodes other;
  store.set_memory(LimitCellId{1}, other);
  store.set_memory(LimitCellId{2}, other);
  EXPECT_GE(store.memory_bytes(), before + 90 * sizeof(CellNode));
}

// Each with its map, polynomials and those that tell what is beyond the boundary.
TEST(CellNodeStore, CountsWhatPiecesHold) {
  CellPiece plain, at_boundary;
  plain.polynomials.resize(3);
  at_boundary.polynomials.resize(3);
  at_boundary.beyond.resize(2);
  CellNodes nodes;
  nodes.nodes.resize(3);
  const std::size_t empty = nodes.memory_bytes();
  nodes.nodes[0].piece = std::make_shared<const CellPiece>(plain);
  const std::size_t one = nodes.memory_bytes();
  EXPECT_EQ(one - empty, sizeof(CellPiece) + 3 * sizeof(CubicPolynomial));
  nodes.nodes[1].piece = std::make_shared<const CellPiece>(at_boundary);
  const std::size_t two = nodes.memory_bytes();
  EXPECT_EQ(two - one, sizeof(CellPiece) + 5 * sizeof(CubicPolynomial));
  nodes.nodes[2].map = std::make_shared<const ParameterMap>();
  EXPECT_EQ(nodes.memory_bytes() - two, sizeof(ParameterMap));
}

TEST(CellNodeStore, TriesNoTilesWhereItIsToldWhetherTheyFit) {
  const Solid solid = prepare_solid(make_bracket());
  const SliceJob job = job_of(solid, {0.2, 0.2, 0.06});
  const InterpolationSpec spec{job.placement, job.grid, {{0, 1e-3}}, kOutsideMm};
  for (const bool told : {false, true}) EXPECT_EQ(make_cell_node_store(told)->tiles_fit(solid, spec), told);
}

TEST(CellNodeStore, NamesTheLayerOfTheFirstWorkerUntilThatIsFound) {
  CellNodeStore store(1 << 20);
  EXPECT_EQ(store.awaited_layer(7), std::nullopt) << "nobody came before";
  EXPECT_EQ(store.awaited_layer(16), 7u);
  store.set_found(16);
  EXPECT_EQ(store.awaited_layer(32), 7u);
  store.set_found(7);
  EXPECT_EQ(store.awaited_layer(48), std::nullopt);
  store.set_found(16);
  EXPECT_EQ(store.awaited_layer(7), std::nullopt);
}

/// A box of cubes at whose boundary the channel is steep, and voxels in rows across it.
TEST(FoundPieces, TellVoxelsThatMayLieBeyondASteepBoundary) {
  ControlMesh mesh = oracle::box_mesh(3, 3, 3);
  oracle::sharpen_by_cells(mesh, 1);
  oracle::grade_by_coordinates(mesh);
  const Solid solid = prepare_solid(mesh);
  const SliceJob job = job_of(solid, {0.4, 0.5, 0.3});
  for (const bool steep : {false, true}) {
    // The channel changes by 1 a millimetre.
    const double tolerance = 0.01, outside_mm = steep ? 1.01 * tolerance : 0.99 * tolerance;
    FoundPieces pieces(solid, {job.placement, job.grid, {{0, tolerance}}, outside_mm}, make_cell_node_store());
    pieces.start(0, kSlabLayers);
    for (std::uint32_t layer = 0; layer < kSlabLayers; ++layer) pieces.find(layer, {});
    std::size_t at_boundary = 0, inside = 0;
    for (const ScannedRun& run : pieces.runs(kSlabLayers / 2)) {
      const SlabPiece& piece = pieces.piece(run.piece);
      EXPECT_EQ(piece.has_beyond(), steep && piece.at_boundary);
      (piece.at_boundary ? at_boundary : inside) += 1;
      // Box3 of the solid: voxels' centres are at whole numbers, and the first ones half a voxel inside.
      const Box3 box(Vec3::Constant(-0.5),
                     Vec3(job.grid.extent.columns, job.grid.extent.rows, job.grid.extent.layers) - Vec3::Constant(0.5));
      for (const double y : {-0.51, -0.49, double(run.row)}) {
        for (const double x : {-0.51, -0.49, 0.5 * (run.begin + run.end)}) {
          const Vec3 voxel(x, y, kSlabLayers / 2);
          const Box3 of_cell = Box3(piece.frame.centre - piece.frame.scale.cwiseInverse(),
                                    piece.frame.centre + piece.frame.scale.cwiseInverse());
          const bool beyond =
              (of_cell.min().x() < 0 && x < box.min().x()) || (of_cell.min().y() < 0 && y < box.min().y());
          EXPECT_EQ(pieces.may_be_beyond(run.piece, voxel), steep && beyond) << voxel.transpose();
        }
      }
      const double end = 0.5 * (run.begin + run.end);
      const SlabPieces::Row row(pieces, run.piece, Vec3(end, run.row, 8));
      const auto none_is_beyond = [&](double from) {
        return row.none_is_beyond(Vec3(from, run.row, 8), Vec3(end, run.row, 8));
      };
      // From far beyond the face to the middle of the piece, and closely about the face.
      for (const double from : {-3.0, -0.501, -0.5000001, -0.5}) {
        bool any = false;
        for (int step = 100; step >= 0; --step) {
          const Vec3 voxel(from + (run.begin == 0 ? 1e-2 : 1e-4) * step * (end - from), run.row, 8);
          any = any || pieces.may_be_beyond(run.piece, voxel);
          EXPECT_EQ(row.may_be_beyond(voxel), pieces.may_be_beyond(run.piece, voxel)) << voxel.transpose();
          const Vec3 last(from + (run.begin == 0 ? 1 : 1e-2) * (end - from), run.row, 8);
          EXPECT_FALSE(any && row.surely_none_is_beyond(voxel, last)) << voxel.transpose();
        }
      }
      EXPECT_TRUE(none_is_beyond(run.begin));
      EXPECT_TRUE(row.surely_none_is_beyond(Vec3(run.begin, run.row, 8), Vec3(end, run.row, 8)));
      if (run.begin == 0) {
        EXPECT_EQ(none_is_beyond(-0.6), !steep);
      }
    }
    EXPECT_GT(at_boundary, 0u);
  }
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

  SharedPieces() : solid_(prepare_solid(make_bracket())), job_(job_of(solid_, {0.2, 0.2, 0.06})) {}

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
          result.holes.insert(result.holes.end(), {pieces.is_in_hole(voxel), pieces.is_for_tiles(voxel),
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

TEST_F(SharedPieces, AreFoundForTheFirstWorkerByAllOthers) {
  const std::uint32_t last = (slabs() - 1) * kSlabLayers;
  for (const bool is_awaited : {false, true}) {
    const auto store = make_cell_node_store();
    EXPECT_EQ(store->awaited_layer(0), std::nullopt);
    if (!is_awaited) store->set_found(0);
    FoundPieces first = worker(store), other = worker(store);
    other.start(last, job_.grid.extent.layers);
    other.find(last, {});
    const std::size_t known_bytes = store->memory_bytes();
    first.start(0, kSlabLayers);
    first.find(0, {});
    EXPECT_EQ(store->memory_bytes() == known_bytes, is_awaited);
    EXPECT_EQ(store->awaited_layer(last), std::nullopt) << "it is found";
  }
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
