// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Scan conversion of a block (interpolation/samples/block_nodes.h): its faces are cut into triangles between nodes, and
// along each row of voxel centres what lies between crossings is inside (even-odd). A row crosses the closed surface an
// even number of times, to the last bit: triangles that share an edge compute its crossings alike. Blocks that share a
// face share its triangles, so that no voxel between them is lost or taken twice, but for rounding.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "core/base/lanes.h"
#include "core/base/types.h"
#include "core/interpolation/samples/block_nodes.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// Voxels with columns [0, columns), rows [0, rows) and layers [first_layer, end_layer).
struct ScanBounds {
  std::uint32_t columns = 0, rows = 0, first_layer = 0, end_layer = 0;
};

/// Voxels of a layer whose centres are inside.
struct BlockRun : VoxelRun {
  std::uint32_t layer;
  float before, after;  // Columns from the first centre back to the block's faces, and from the last one on.
};

/// Memory is kept from block to block.
class BlockRaster {
 public:
  /// Appends the voxels of the bounds whose centres are inside, by layer, by row, by column. `points`: in voxels, so
  /// that the centre of voxel (column, row, layer) is at those numbers. `step`: BlockShape's.
  void scan(const BlockPoints& points, std::size_t step, const ScanBounds& bounds, std::vector<BlockRun>& runs);

 private:
  static constexpr std::size_t kMostCrossings = 6;  // Crossings of a row; rows with more are left out.
  struct Row {
    std::uint32_t count = 0;
    std::array<double, kMostCrossings> columns;
  };
  /// Where four layers cross a triangle, by rising row.
  struct Segments {
    Lanes y, x, slope;  // The first end, and columns a row.
    Lanes begin, end;   // Rows that are crossed.
  };
  struct Node {
    double x, y, z;
    std::uint32_t layer;  // The first one of the bounds that isn't below.
  };

  void load(const BlockPoints& points, const ScanBounds& bounds);
  void scan_face(std::size_t axis, std::size_t side, std::size_t step);
  void scan_triangle(const Node& a, const Node& b, const Node& c);
  void cross_layers(const Node& low, const Node& high, const Node& from, const Node& to);
  Lanes first_rows(Lanes y) const;
  void cross_rows(std::uint32_t layer, const Segments& segments, std::uint32_t lane);
  static void append_runs(Row& row, std::uint32_t layer, std::uint32_t y, std::uint32_t columns,
                          std::vector<BlockRun>& runs);

  std::array<Node, std::tuple_size_v<BlockPoints>> nodes_;
  std::uint32_t first_layer_ = 0, end_layer_ = 0, first_row_ = 0, end_row_ = 0;  // That the block's box meets.
  std::vector<Row> rows_;                                                        // By layer, then by row.
};

}  // namespace ccslice
