// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/distance/triangle_tree.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/types.h"

namespace ccslice {
namespace {

/// Every third bit from the lowest on, of 21.
std::uint64_t spread(std::uint64_t bits) noexcept {
  bits = (bits | bits << 32) & 0x1f00000000ffffu;
  bits = (bits | bits << 16) & 0x1f0000ff0000ffu;
  bits = (bits | bits << 8) & 0x100f00f00f00f00fu;
  bits = (bits | bits << 4) & 0x10c30c30c30c30c3u;
  return (bits | bits << 2) & 0x1249249249249249u;
}

FloatPoint middle_of(const FloatTriangle& triangle) noexcept {
  FloatPoint middle;
  for (std::size_t a = 0; a < 3; ++a) middle[a] = (triangle[0][a] + triangle[1][a] + triangle[2][a]) / 3;
  return middle;
}

double area_of(const FloatTriangle& t) {
  return (to_vec3(t[1]) - to_vec3(t[0])).cross(to_vec3(t[2]) - to_vec3(t[0])).norm() / 2;
}

void sort_by_place(std::vector<FloatTriangle>& triangles) {
  FloatPoint low = middle_of(triangles.front()), high = low;
  for (const FloatTriangle& triangle : triangles) {
    const FloatPoint middle = middle_of(triangle);
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], middle[a]);
      high[a] = std::max(high[a], middle[a]);
    }
  }
  const float extent = std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2], 1e-6f});
  const double scale = ((1 << 21) - 1) / static_cast<double>(extent);
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    const FloatPoint middle = middle_of(triangles[i]);
    std::uint64_t code = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      code |= spread(static_cast<std::uint64_t>(static_cast<double>(middle[a] - low[a]) * scale)) << a;
    }
    order[i] = {code, static_cast<std::uint32_t>(i)};
  }
  std::sort(order.begin(), order.end());
  std::vector<FloatTriangle> sorted(triangles.size());
  for (std::size_t i = 0; i < order.size(); ++i) sorted[i] = triangles[order[i].second];
  triangles = std::move(sorted);
}

}  // namespace

TriangleTree::TriangleTree(std::vector<FloatTriangle> triangles) {
  sort_by_place(triangles);
  groups_.resize((triangles.size() + kFloatLanes - 1) / kFloatLanes);
  leaves_ = std::bit_ceil(groups_.size());
  constexpr float kNone = std::numeric_limits<float>::infinity();  // A box of nothing.
  boxes_.assign(2 * leaves_, {{kNone, kNone, kNone}, {-kNone, -kNone, -kNone}});
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    FloatBox& box = boxes_[leaves_ + g];
    for (std::size_t lane = 0; lane < kFloatLanes; ++lane) {
      const FloatTriangle& triangle = triangles[std::min(g * kFloatLanes + lane, triangles.size() - 1)];
      groups_[g].set(lane, triangle);
      if (g * kFloatLanes + lane < triangles.size()) area_mm2_ += area_of(triangle);
      for (const FloatPoint& corner : triangle) {
        for (std::size_t a = 0; a < 3; ++a) {
          box.min[a] = std::min(box.min[a], corner[a]);
          box.max[a] = std::max(box.max[a], corner[a]);
        }
      }
    }
  }
  for (std::size_t i = leaves_ - 1; i > 0; --i) {
    for (std::size_t a = 0; a < 3; ++a) {
      boxes_[i].min[a] = std::min(boxes_[2 * i].min[a], boxes_[2 * i + 1].min[a]);
      boxes_[i].max[a] = std::max(boxes_[2 * i].max[a], boxes_[2 * i + 1].max[a]);
    }
  }
}

std::vector<std::uint32_t> TriangleTree::find_near(const FloatBox& box, float bound) const {
  std::vector<std::uint32_t> found;
  const float squared = bound * bound;
  std::array<std::size_t, 64> stack;
  std::size_t depth = 0;
  stack[depth++] = 1;
  while (depth > 0) {
    const std::size_t node = stack[--depth];
    if (!(boxes_[node].squared_distance(box) <= squared)) continue;
    if (node >= leaves_) {
      found.push_back(static_cast<std::uint32_t>(node - leaves_));
      continue;
    }
    stack[depth++] = 2 * node + 1;
    stack[depth++] = 2 * node;
  }
  return found;
}

}  // namespace ccslice
