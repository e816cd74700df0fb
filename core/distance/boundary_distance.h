// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How far points are from a surface of triangles, up to a reach.
//
// Space is cut into blocks, and a block, once a point is in it, is halved into cubes. Distance is 1-Lipschitz: with d
// at the middle of a cube and r from there to its corners, distances in the cube are within d - r and d + r. So a cube
// that is beyond the reach needs nothing more. Others are halved until few groups of triangles can be the nearest
// anywhere in them, and list these. Where only the side of bounds matters, a slab (distance_cube.h) leaves few points
// of a cube to be looked at.

#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/base/types.h"
#include "core/distance/distance_cube.h"
#include "core/distance/triangle_tree.h"

namespace ccslice {

/// Safe to use from any thread.
class BoundaryDistance {
 public:
  /// Points are no farther than `farthest_mm` from the origin. REQUIRES: triangles, and a reach that floats can square.
  BoundaryDistance(std::vector<FloatTriangle> triangles, double reach_mm, double farthest_mm);

  /// values[k]: the distance from first + (begin + k) step, mm, and at most the reach. It follows from the point alone.
  /// With bounds, a value is only on the same side of each as the distance: below it, or not. Throws
  /// Error{kCancelled}.
  void sample(const Vec3& first, const Vec3& step, std::uint32_t begin, std::span<const float> bounds_mm,
              std::span<float> values, const CancellationToken& cancel = {}) const;

  /// Blocks add to it as points come into them.
  std::size_t memory_bytes() const noexcept { return bytes_; }
  /// About what is held once points were everywhere within the reach of a surface in a box of this size.
  static double expected_bytes(double triangles, double area_mm2, const Vec3& box_mm, double reach_mm);

 private:
  struct Node {
    enum class Kind : std::uint8_t { kBeyondReach, kHalved, kLeaf };

    float distance = 0;       // From the middle.
    std::uint32_t first = 0;  // The first of eight children, or the number of the leaf.
    Kind kind = Kind::kBeyondReach;
  };
  /// A cube without children. Its slab is made when it is first asked for.
  struct Leaf {
    std::uint32_t first_group = 0, end_group = 0;
    mutable std::once_flag slab_made;
    mutable DistanceSlab slab;

    Leaf(std::uint32_t first, std::uint32_t end) : first_group(first), end_group(end) {}
  };
  struct Cubes {
    std::vector<Node> nodes;
    std::deque<Leaf> leaves;
    std::vector<std::uint32_t> groups;
  };
  struct Block {
    std::once_flag made;
    std::unique_ptr<const Cubes> cubes;
  };
  /// Blocks that cover a box.
  struct Blocks {
    double edge_mm = 0;
    std::array<std::size_t, 3> along = {};
    std::size_t count = 0;
  };
  struct Row;
  class Halver;

  static Blocks blocks_of(const Vec3& box_mm, double cube_mm);
  std::size_t block_of(const Vec3& point, DistanceCube& cube) const noexcept;
  const Cubes& cubes_of(std::size_t block, const DistanceCube& cube, const CancellationToken& cancel) const;
  void walk(const Cubes& cubes, const Node& node, const DistanceCube& cube, const Row& row, std::size_t begin,
            std::size_t end) const;
  void sample_leaf(const Cubes& cubes, const Leaf& leaf, const DistanceCube& cube, const Row& row, std::size_t begin,
                   std::size_t end) const;
  float distance(std::span<const std::uint32_t> groups, const Vec3& point) const noexcept;

  static constexpr std::size_t kNoBlock = ~std::size_t{0};

  const TriangleTree triangles_;
  const float reach_mm_;
  Vec3 low_ = Vec3::Zero();  // The least corner of block 0.
  double cube_mm_ = 0;
  double rounding_mm_ = 0;  // More than distances lose to it.
  Blocks size_;
  std::unique_ptr<Block[]> blocks_;
  mutable std::atomic<std::size_t> bytes_ = 0;
};

}  // namespace ccslice
