// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Two banks of three bores on an oil pan's flange. Seen from above the block is a frame of 5 x 5 cells:
//
//   wall | bank | valley | bank | wall      x 5 rows: front wall, three bores, back wall
//
// The six cells that hold bores are rings of four cells each, the liners: 19 + 6 * 4 = 43 cells, in 7 layers 301. The
// valley lies two layers lower than the banks (6 cells less), and a shaft comes out of the front wall through an inset
// (6 cells more), which brings the extraordinary vertices. Extraordinary edges run up and down at the liners' outer
// corners, where 5 or 6 cells meet.

#include "core/models/model_builder.h"
#include "core/models/models.h"

namespace ccslice {
namespace {

constexpr int kLines = 6, kCellsOfLine = 5, kLayers = 7;
constexpr double kLinerHardness = 1, kBlockHardness = 0.2;

/// Half the frame's extent and the bores' half-width, layer by layer.
struct Level {
  double z, half_x, half_y, bore;
};
constexpr std::array<Level, kLayers + 1> kLevels = {{{0.0, 23.6, 23.6, 6.15},
                                                     {1.7, 23.6, 23.6, 6.15},
                                                     {2.9, 17.4, 20.6, 6.1},
                                                     {7.0, 16.6, 20.0, 6.0},
                                                     {12.0, 16.6, 20.0, 5.95},
                                                     {15.5, 16.6, 20.0, 5.95},
                                                     {19.2, 16.8, 20.2, 5.95},
                                                     {20.6, 16.8, 20.2, 5.95}}};
constexpr std::array<double, 4> kInnerX = {-15.9, -3.3, 3.3, 15.9};
constexpr std::array<double, 4> kInnerY = {-19.2, -6.4, 6.4, 19.2};

constexpr bool is_bore(int i, int j) { return (i == 1 || i == 3) && j >= 1 && j <= 3; }
constexpr bool is_open_valley(int i, int j, int k) { return i == 2 && j >= 1 && j <= 3 && k >= kLayers - 2; }
constexpr bool is_shaft(int i, int j, int k) { return i == 2 && j == 0 && k == 3; }

class Engine {
 public:
  Engine() : builder_("hardness") {
    for (int k = 0; k <= kLayers; ++k) add_level(k);
  }

  ControlMesh build() && {
    for (int k = 0; k < kLayers; ++k) {
      for (int j = 0; j < kCellsOfLine; ++j) {
        for (int i = 0; i < kCellsOfLine; ++i) add_cells(i, j, k);
      }
    }
    const Box3 limit(Vec3(-23.31295, -23.45, 0), Vec3(23.31295, 23.45, 20.6));
    return std::move(builder_).finish(limit, Vec3(1090 * 0.0423, 547 * 0.0846, 688 * 0.03));
  }

 private:
  using Vertex = ModelBuilder::Vertex;

  static double line(const std::array<double, 4>& inner, double half, int i) {
    return i == 0 ? -half : i == kLines - 1 ? half : inner[static_cast<std::size_t>(i - 1)];
  }

  void add_level(int k) {
    const Level& level = kLevels[static_cast<std::size_t>(k)];
    for (int j = 0; j < kLines; ++j) {
      for (int i = 0; i < kLines; ++i) {
        const Vec3 at(line(kInnerX, level.half_x, i), line(kInnerY, level.half_y, j), level.z);
        frame_[k][j][i] = builder_.add_vertex(at, kBlockHardness);
      }
    }
    for (int j = 1; j <= 3; ++j) {
      for (const int i : {1, 3}) add_bore(i, j, k);
    }
  }

  /// The inside of a liner: a square, which the scheme turns into a circle to 1.5 %.
  void add_bore(int i, int j, int k) {
    const Vec3 low = builder_.position(frame_[k][j][i]), high = builder_.position(frame_[k][j + 1][i + 1]);
    const Vec3 middle = (low + high) / 2;
    const double half = kLevels[static_cast<std::size_t>(k)].bore;
    constexpr std::array<std::array<int, 2>, 4> kRing = {{{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};
    for (std::size_t c = 0; c < 4; ++c) {
      bores_[k][j][i][c] = builder_.add_vertex(middle + half * Vec3(kRing[c][0], kRing[c][1], 0), kLinerHardness);
    }
  }

  std::array<Vertex, 4> frame_ring(int i, int j, int k) const {
    return {frame_[k][j][i], frame_[k][j][i + 1], frame_[k][j + 1][i + 1], frame_[k][j + 1][i]};
  }

  void add_cells(int i, int j, int k) {
    const std::array<Vertex, 4> low = frame_ring(i, j, k), high = frame_ring(i, j, k + 1);
    if (is_open_valley(i, j, k)) return;
    if (is_bore(i, j)) return add_liner(i, j, k);
    if (is_shaft(i, j, k)) return add_shaft(low, high);
    builder_.add_hex({low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]});
  }

  void add_liner(int i, int j, int k) {
    const std::array<Vertex, 4> low = frame_ring(i, j, k), high = frame_ring(i, j, k + 1);
    const std::array<Vertex, 4>&in_low = bores_[k][j][i], &in_high = bores_[k + 1][j][i];
    for (std::size_t c = 0; c < 4; ++c) {
      const std::size_t n = (c + 1) % 4;
      builder_.add_hex({low[c], low[n], in_low[n], in_low[c], high[c], high[n], in_high[n], in_high[c]});
    }
  }

  /// Out of the front, towards -y.
  void add_shaft(const std::array<Vertex, 4>& low, const std::array<Vertex, 4>& high) {
    const std::array<Vertex, 4> end = builder_.add_hex_with_inset(
        {low[3], low[2], high[2], high[3], low[0], low[1], high[1], high[0]}, 0.9, 0.6, kLinerHardness);
    std::array<Vertex, 4> tip{};
    for (std::size_t c = 0; c < 4; ++c) {
      tip[c] = builder_.add_vertex(builder_.position(end[c]) - Vec3(0, 3, 0), kLinerHardness);
    }
    builder_.add_hex({end[0], end[1], end[2], end[3], tip[0], tip[1], tip[2], tip[3]});
  }

  ModelBuilder builder_;
  Vertex frame_[kLayers + 1][kLines][kLines] = {};
  std::array<Vertex, 4> bores_[kLayers + 1][kCellsOfLine][kCellsOfLine] = {};
};

}  // namespace

ControlMesh make_engine() { return Engine().build(); }

}  // namespace ccslice
