// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/pictures/voxel_surface.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace ccslice::cli {
namespace {

constexpr int kSmoothings = 6;
constexpr std::uint32_t kNone = 0xffffffff;

/// The vertices and squares of a block, in places of voxels: (0, 0, 0) is the centre of the first one.
class SurfaceNet {
 public:
  explicit SurfaceNet(const VoxelBlock& block) : block_(block) {
    for (std::size_t axis = 0; axis < 3; ++axis) corners_[axis] = block.size[axis] + 1;
    place_vertices();
    for (int axis = 0; axis < 3; ++axis) span_squares(axis);
    for (int i = 0; i < kSmoothings; ++i) smooth();
  }

  client::Surface surface() const {
    client::Surface surface;
    for (const Vec3& place : places_) {
      const Vec3 point = block_.origin_mm + (place + Vec3::Constant(0.5)).cwiseProduct(block_.pitch_mm);
      surface.points_mm.push_back({point.x(), point.y(), point.z()});
    }
    for (const auto& square : squares_) {
      surface.triangles.push_back({square[0], square[1], square[2]});
      surface.triangles.push_back({square[0], square[2], square[3]});
    }
    return surface;
  }

 private:
  using Voxel = std::array<int, 3>;

  bool inside(const Voxel& voxel) const {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (voxel[axis] < 0 || voxel[axis] >= block_.size[axis]) return false;
    }
    return block_.inside[block_.index(voxel[0], voxel[1], voxel[2])] != 0;
  }

  /// `corner`: what lies between its eight voxels corner - 1 and corner.
  std::uint32_t& vertex_at(const Voxel& corner) {
    const auto [x, y, z] = corner;
    return vertices_[(static_cast<std::size_t>(z) * static_cast<std::size_t>(corners_[1]) +
                      static_cast<std::size_t>(y)) *
                         static_cast<std::size_t>(corners_[0]) +
                     static_cast<std::size_t>(x)];
  }

  template <typename Visit>
  static void for_each(const Voxel& end, const Visit& visit) {
    for (int z = 0; z < end[2]; ++z) {
      for (int y = 0; y < end[1]; ++y) {
        for (int x = 0; x < end[0]; ++x) visit(Voxel{x, y, z});
      }
    }
  }

  void place_vertices() {
    vertices_.assign(static_cast<std::size_t>(corners_[0]) * static_cast<std::size_t>(corners_[1]) *
                         static_cast<std::size_t>(corners_[2]),
                     kNone);
    for_each(corners_, [&](const Voxel& corner) {
      int count = 0;
      for (int i = 0; i < 8; ++i) {
        count += inside({corner[0] - (i & 1), corner[1] - (i >> 1 & 1), corner[2] - (i >> 2)}) ? 1 : 0;
      }
      if (count == 0 || count == 8) return;
      vertex_at(corner) = static_cast<std::uint32_t>(middles_.size());
      middles_.push_back(Vec3(corner[0], corner[1], corner[2]) - Vec3::Constant(0.5));
    });
    places_ = middles_;
  }

  /// Squares between neighbours along the axis.
  void span_squares(int axis) {
    const auto along = static_cast<std::size_t>(axis), second = (along + 1) % 3, third = (along + 2) % 3;
    for_each(corners_, [&](const Voxel& upper) {
      Voxel lower = upper;
      --lower[along];
      const bool is_lower_inside = inside(lower);
      if (is_lower_inside == inside(upper)) return;
      std::array<std::uint32_t, 4> square{};
      constexpr std::array<std::array<int, 2>, 4> kRound = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
      for (std::size_t i = 0; i < 4; ++i) {
        Voxel corner = upper;
        corner[second] += kRound[i][0];
        corner[third] += kRound[i][1];
        square[is_lower_inside ? i : 3 - i] = vertex_at(corner);
      }
      squares_.push_back(square);
    });
  }

  void smooth() {
    std::vector<Vec3> sums(places_.size(), Vec3::Zero());
    std::vector<int> counts(places_.size(), 0);
    for (const auto& square : squares_) {
      for (std::size_t i = 0; i < 4; ++i) {
        for (const std::size_t j : {(i + 1) % 4, (i + 3) % 4}) {
          sums[square[i]] += places_[square[j]];
          ++counts[square[i]];
        }
      }
    }
    for (std::size_t v = 0; v < places_.size(); ++v) {
      if (counts[v] == 0) continue;
      const Vec3 half = Vec3::Constant(0.5), low = middles_[v] - half, high = middles_[v] + half;
      places_[v] = (0.5 * (places_[v] + sums[v] / counts[v])).cwiseMax(low).cwiseMin(high);
    }
  }

  const VoxelBlock& block_;
  Voxel corners_{};
  std::vector<std::uint32_t> vertices_;  // By corner.
  std::vector<Vec3> middles_, places_;   // By vertex: of its eight voxels; where it is.
  std::vector<std::array<std::uint32_t, 4>> squares_;
};

}  // namespace

client::Surface voxel_surface(const VoxelBlock& block) { return SurfaceNet(block).surface(); }

}  // namespace ccslice::cli
