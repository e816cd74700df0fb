// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/box_tree.h"

#include <algorithm>
#include <numeric>

namespace ccslice {

namespace {
constexpr std::uint32_t kLeafItems = 4;
}

BoxTree::BoxTree(std::span<const Box3> boxes, const CancellationToken& cancel)
    : boxes_(boxes.begin(), boxes.end()), items_(boxes.size()) {
  if (boxes_.empty()) return;
  std::iota(items_.begin(), items_.end(), 0u);
  nodes_.reserve(boxes_.size());
  nodes_.emplace_back();
  split(0, 0, static_cast<std::uint32_t>(items_.size()), cancel);
}

void BoxTree::split(std::uint32_t node, std::uint32_t first, std::uint32_t count, const CancellationToken& cancel) {
  cancel.throw_if_cancelled();
  Box3 box, centres;
  for (std::uint32_t i = first; i < first + count; ++i) {
    box.extend(boxes_[items_[i]]);
    centres.extend(boxes_[items_[i]].center());
  }
  nodes_[node].box = box;
  if (count <= kLeafItems) {
    nodes_[node].first = first;
    nodes_[node].count = count;
    return;
  }
  // Median split along the longest extent of the centres: the depth is logarithmic, whatever the boxes.
  Eigen::Index axis = 0;
  centres.sizes().maxCoeff(&axis);
  const auto begin = items_.begin() + first;
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const double ca = boxes_[a].center()[axis], cb = boxes_[b].center()[axis];
    return ca != cb ? ca < cb : a < b;
  });
  const auto children = static_cast<std::uint32_t>(nodes_.size());
  nodes_[node].first = children;
  nodes_.emplace_back();
  nodes_.emplace_back();
  split(children, first, half, cancel);
  split(children + 1, first + half, count - half, cancel);
}

}  // namespace ccslice
