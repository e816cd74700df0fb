// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/prepare/box_blocks.h"

#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

namespace ccslice {

namespace {

constexpr float kFloatEpsilon = std::numeric_limits<float>::epsilon();
constexpr float kNoBound = std::numeric_limits<float>::quiet_NaN();

float rounded_down(double value) {
  const auto nearest = static_cast<float>(value);
  return nearest - kFloatEpsilon * std::abs(nearest) - std::numeric_limits<float>::min();
}
float rounded_up(double value) { return -rounded_down(-value); }

/// The middle of a box.
struct Middle {
  std::array<float, 3> at;
  std::uint32_t box;
};

/// Cuts along the longest extent of the middles until blocks are left. All but the last one are full.
void cut(std::span<Middle> items, const CancellationToken& cancel) {
  constexpr std::size_t kMost = BoxBlocks::kBlockBoxes;
  if (items.size() <= kMost) return;
  cancel.throw_if_cancelled();
  std::array<float, 3> low = items.front().at, high = low;
  for (const Middle& item : items) {
    for (std::size_t a = 0; a < 3; ++a) low[a] = std::min(low[a], item.at[a]), high[a] = std::max(high[a], item.at[a]);
  }
  std::size_t axis = 0;
  for (std::size_t a = 1; a < 3; ++a) {
    if (high[a] - low[a] > high[axis] - low[axis]) axis = a;
  }
  const std::size_t blocks = (items.size() + kMost - 1) / kMost, first = blocks / 2 * kMost;
  std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(first), items.end(),
                   [axis](const Middle& a, const Middle& b) {
                     return a.at[axis] != b.at[axis] ? a.at[axis] < b.at[axis] : a.box < b.box;
                   });
  cut(items.first(first), cancel);
  cut(items.subspan(first), cancel);
}

}  // namespace

BoxBlocks::BoxBlocks(std::span<const Box3> boxes, const CancellationToken& cancel) {
  Box3 all;
  for (const Box3& box : boxes) all.extend(box);
  const Vec3 origin = boxes.empty() ? Vec3::Zero().eval() : all.center();
  std::vector<Middle> middles;
  middles.reserve(boxes.size());
  for (const Box3& box : boxes) {
    const Eigen::Vector3f middle = (box.center() - origin).cast<float>();
    middles.push_back({{middle.x(), middle.y(), middle.z()}, static_cast<std::uint32_t>(middles.size())});
  }
  cut(middles, cancel);
  const std::size_t count = (boxes.size() + kBlockBoxes - 1) / kBlockBoxes;
  order_.reserve(count * kBlockBoxes);
  for (const Middle& middle : middles) order_.push_back(middle.box);
  middles = {};
  order_.resize(count * kBlockBoxes, kMissing);
  const auto rounded = [&](const Box3& box) {
    Bounds bounds;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      bounds.min[a] = rounded_down(box.min()[axis] - origin[axis]);
      bounds.max[a] = rounded_up(box.max()[axis] - origin[axis]);
    }
    return bounds;
  };
  // Blocks by where they begin along x.
  std::vector<Box3> hulls(count);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    if (order_[i] != kMissing) hulls[i / kBlockBoxes].extend(boxes[order_[i]]);
  }
  std::vector<std::uint32_t> turns(count);
  std::iota(turns.begin(), turns.end(), 0u);
  std::ranges::sort(turns, {}, [&](std::uint32_t block) { return std::pair(hulls[block].min().x(), block); });
  std::vector<std::uint32_t> order;
  order.reserve(order_.size());
  for (const std::uint32_t block : turns) {
    blocks_.push_back(rounded(hulls[block]));
    const auto begin = order_.begin() + static_cast<std::ptrdiff_t>(block * kBlockBoxes);
    order.insert(order.end(), begin, begin + kBlockBoxes);
  }
  order_.swap(order);
  groups_.resize(order_.size() / kFloatLanes);
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const bool is_missing = order_[i] == kMissing;
    const Bounds bounds = is_missing ? Bounds{} : rounded(boxes[order_[i]]);
    Group& group = groups_[i / kFloatLanes];
    for (std::size_t a = 0; a < 3; ++a) {
      group.min[a][i % kFloatLanes] = is_missing ? kNoBound : bounds.min[a];
      group.max[a][i % kFloatLanes] = is_missing ? kNoBound : bounds.max[a];
    }
  }
}

}  // namespace ccslice
