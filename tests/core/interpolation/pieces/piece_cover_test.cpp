// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/piece_cover.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "core/models/models.h"
#include "core/prepare/prepare_solid.h"
#include "tests/core/interpolation/found_pieces.h"
#include "tests/core/slicer/test_jobs.h"

namespace ccslice {
namespace {

// A sharp box with a linear gradient along x: pieces are its cells, exact to rounding. 24 x 16 x 8 mm in 6 x 4 x 2
// cells, at a pitch that puts no voxel centre on a face between cells.
class PieceCoverTest : public testing::Test {
 protected:
  PieceCoverTest()
      : solid_(prepare_solid(make_box())),
        job_(job_of(solid_, {0.15, 0.15, 0.15})),
        pieces_(solid_, {job_.placement, job_.grid, {{0, 1e-3}}, kOutsideMm}, make_cell_node_store()) {
    pieces_.start(0, 16);
    pieces_.find(5, {});
  }

  void resolve(std::vector<VoxelRun> spans) { rows_.resolve(pieces_, 5, job_.grid.extent.rows, spans, sorted_); }

  /// Its columns from 40 on are the box's.
  Grid grid_from_before_the_box() const {
    GridRequest request;
    request.pitch = job_.grid.pitch;
    request.origin_mm = job_.grid.origin_mm - Vec3(6, 0, 0);
    request.extent = GridExtent{200, 40, 16};
    return plan_grid(*solid_, job_.placement, request);
  }

  std::uint64_t painted() const {
    std::uint64_t voxels = 0;
    for (const PieceRun& run : rows_.painted()) voxels += run.end - run.begin;
    return voxels;
  }

  Solid solid_;
  SliceJob job_;
  FoundPieces pieces_;
  PieceCover rows_;
  RunsByRow sorted_;
};

TEST_F(PieceCoverTest, PaintAllThatIsInside) {
  std::vector<VoxelRun> spans;
  for (std::uint32_t y = 0; y < job_.grid.extent.rows; ++y) spans.push_back({y, 0, job_.grid.extent.columns});
  resolve(spans);
  EXPECT_EQ(painted(), std::uint64_t{job_.grid.extent.rows} * job_.grid.extent.columns);
  EXPECT_EQ(rows_.painted().size(), 6u * job_.grid.extent.rows);
  EXPECT_TRUE(rows_.for_tiles().empty());
}

TEST_F(PieceCoverTest, PaintNothingElse) {
  resolve({{10, 20, 25}, {10, 31, 32}, {11, 0, 30}});
  EXPECT_EQ(painted(), 36u);
  ASSERT_EQ(rows_.painted().size(), 4u);
  EXPECT_EQ(rows_.painted()[0].begin, 20u);
  EXPECT_EQ(rows_.painted()[0].end, 25u);
  EXPECT_EQ(rows_.painted()[1].row, 10u);
  EXPECT_EQ(rows_.painted()[1].end, 32u);
  EXPECT_EQ(rows_.painted()[2].row, 11u);
  EXPECT_TRUE(rows_.for_tiles().empty());
}

// Long runs in cells that no piece pays in aren't cut into tiles: those wouldn't pay either.
TEST_F(PieceCoverTest, LeaveLongRunsOfHolesToInversion) {
  FoundPieces pieces(solid_, {job_.placement, job_.grid, {{0, 1e-20}}, kOutsideMm}, make_cell_node_store());
  pieces.start(0, 16);
  pieces.find(5, {});
  std::vector<VoxelRun> spans;
  for (std::uint32_t y = 0; y < job_.grid.extent.rows; ++y) spans.push_back({y, 0, job_.grid.extent.columns});
  rows_.resolve(pieces, 5, job_.grid.extent.rows, spans, sorted_);
  EXPECT_EQ(painted(), 0u);
  EXPECT_TRUE(rows_.for_tiles().empty());
  ASSERT_EQ(rows_.to_invert().size(), spans.size());
  for (std::size_t k = 0; k < spans.size(); ++k) {
    EXPECT_EQ(rows_.to_invert()[k].end, job_.grid.extent.columns);
    EXPECT_TRUE(rows_.to_invert()[k].hint);
  }
}

TEST_F(PieceCoverTest, LeaveRowsThatAreToBeInverted) {
  std::vector<VoxelRun> spans;
  for (std::uint32_t y = 0; y < job_.grid.extent.rows; ++y) spans.push_back({y, 0, job_.grid.extent.columns});
  resolve(spans);
  rows_.invert({10, 30}, spans);
  EXPECT_EQ(painted(), std::uint64_t{job_.grid.extent.rows - 20} * job_.grid.extent.columns);
  ASSERT_EQ(rows_.to_invert().size(), 20u);
  for (std::uint32_t k = 0; k < 20; ++k) {
    EXPECT_EQ(rows_.to_invert()[k].row, 10 + k);
    EXPECT_EQ(rows_.to_invert()[k].end, job_.grid.extent.columns);
  }
  rows_.invert({0, 5}, spans);
  EXPECT_EQ(rows_.to_invert().size(), 25u);
  EXPECT_EQ(rows_.to_invert()[0].row, 0u) << "by row";
  EXPECT_EQ(rows_.to_invert()[24].row, 29u);
}

TEST_F(PieceCoverTest, AreEmptyForAnEmptyLayer) {
  resolve({});
  EXPECT_TRUE(rows_.painted().empty());
  EXPECT_TRUE(rows_.for_tiles().empty());
}

// Beyond the solid no piece reaches farther than a share of its own size.
TEST_F(PieceCoverTest, LeaveWhatIsFarFromPieces) {
  const Grid grid = grid_from_before_the_box();
  FoundPieces pieces(solid_, {job_.placement, grid, {{0, 1e-3}}, kOutsideMm}, make_cell_node_store());
  pieces.start(0, 16);
  pieces.find(5, {});
  rows_.resolve(pieces, 5, grid.extent.rows, std::vector<VoxelRun>{{3, 39, 60}, {4, 10, 60}, {5, 0, 12}}, sorted_);
  ASSERT_EQ(rows_.painted().size(), 2u);
  EXPECT_EQ(rows_.painted()[0].begin, 39u);  // A voxel before the first piece, which has 26 along the row.
  EXPECT_EQ(rows_.painted()[1].begin, 40u);
  ASSERT_EQ(rows_.to_invert().size(), 2u);
  EXPECT_EQ(rows_.to_invert()[0].row, 4u);
  EXPECT_EQ(rows_.to_invert()[0].begin, 10u);
  EXPECT_EQ(rows_.to_invert()[0].end, 40u);
  ASSERT_TRUE(rows_.to_invert()[0].hint);  // Beside a piece.
  EXPECT_EQ(rows_.to_invert()[0].hint->uvw.x(), 0);
  EXPECT_EQ(rows_.to_invert()[1].row, 5u);
  EXPECT_EQ(rows_.to_invert()[1].begin, 0u);
  EXPECT_EQ(rows_.to_invert()[1].end, 12u);
  EXPECT_FALSE(rows_.to_invert()[1].hint);
  EXPECT_TRUE(rows_.for_tiles().empty());  // No cell is small.
}

TEST_F(PieceCoverTest, TellGapsThatWereClosed) {
  const Grid grid = grid_from_before_the_box();
  FoundPieces pieces(solid_, {job_.placement, grid, {{0, 1e-3}}, kOutsideMm}, make_cell_node_store());
  pieces.start(0, 16);
  pieces.find(5, {});
  rows_.resolve(pieces, 5, grid.extent.rows, std::vector<VoxelRun>{{3, 39, 60}, {4, 10, 60}}, sorted_);
  ASSERT_EQ(rows_.closed_gaps().size(), 1u);
  EXPECT_EQ(rows_.closed_gaps()[0].row, 3u);
  EXPECT_EQ(rows_.closed_gaps()[0].begin, 39u);
  EXPECT_EQ(rows_.closed_gaps()[0].end, 40u);
  EXPECT_EQ(rows_.painted_at(3, 39), &rows_.painted()[0]);
  EXPECT_EQ(rows_.painted_at(4, 59), &rows_.painted()[1]);
  for (const auto& [row, column] : {std::pair(2u, 45u), {3u, 38u}, {3u, 60u}, {4u, 39u}, {5u, 45u}}) {
    EXPECT_EQ(rows_.painted_at(row, column), nullptr) << row << " " << column;
  }
  rows_.resolve(pieces, 5, grid.extent.rows, std::vector<VoxelRun>{{4, 40, 60}}, sorted_);
  EXPECT_TRUE(rows_.closed_gaps().empty());
}

// The reach is a share of the piece's size, 2.67 of its 26.7 columns, counted from its face: that is 39.5 and a bit.
TEST_F(PieceCoverTest, FollowPiecesAsFarAsTheirFacesAllow) {
  for (const auto& [before_mm, is_painted] : {std::pair(6 + 0.15 * 0.1, true), std::pair(6 + 0.15 * 0.2, false)}) {
    GridRequest request;
    request.pitch = job_.grid.pitch;
    request.origin_mm = job_.grid.origin_mm - Vec3(before_mm, 0, 0);
    request.extent = GridExtent{200, 40, 16};
    const Grid grid = plan_grid(*solid_, job_.placement, request);
    FoundPieces pieces(solid_, {job_.placement, grid, {{0, 1e-3}}, kOutsideMm}, make_cell_node_store());
    pieces.start(0, 16);
    pieces.find(5, {});
    rows_.resolve(pieces, 5, grid.extent.rows, std::vector<VoxelRun>{{3, 37, 60}}, sorted_);
    EXPECT_EQ(rows_.painted()[0].begin, is_painted ? 37u : 40u) << before_mm;
    EXPECT_EQ(rows_.to_invert().empty(), is_painted) << before_mm;
  }
}

// Following the gradient by what contours may be off is beyond the tolerance: voxels off the solid are inverted.
TEST_F(PieceCoverTest, LeaveWhatLiesOffTheSolidWhereMaterialsAreSteep) {
  const Grid grid = grid_from_before_the_box();
  for (const auto& [tolerance, first_painted] : {std::pair(1e-3, 39u), std::pair(1e-5, 40u)}) {
    FoundPieces pieces(solid_, {job_.placement, grid, {{0, tolerance}}, kOutsideMm}, make_cell_node_store());
    pieces.start(0, 16);
    pieces.find(5, {});
    rows_.resolve(pieces, 5, grid.extent.rows, std::vector<VoxelRun>{{3, 39, 60}}, sorted_);
    ASSERT_EQ(rows_.painted().size(), 1u);
    EXPECT_EQ(rows_.painted()[0].begin, first_painted);
    EXPECT_EQ(rows_.painted()[0].end, 60u);
    EXPECT_EQ(rows_.to_invert().size(), first_painted - 39u);
    EXPECT_TRUE(rows_.for_tiles().empty());
  }
}

}  // namespace
}  // namespace ccslice
