// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_leaves.h"

#include <algorithm>
#include <cmath>

namespace ccslice {
namespace {

/// What remains at an irregular vertex becomes a leaf once its hull is this share of the tolerance.
constexpr double kIrregularShare = 0.125;
constexpr std::size_t kNodesPerPoll = 1024;

}  // namespace

void ContourLeaves::start(const LeafCriteria& criteria) {
  if (tree_.start(criteria.to_axes, visited_) || ++layer_ == 0) {
    marks_.clear();
    layer_ = 1;
  }
  criteria_ = criteria;
  small_remainder_mm_ = std::min(kIrregularShare * criteria.tolerance_mm, criteria.small_mm);
  visited_ = 0;
  leaves_.clear();
}

void ContourLeaves::collect(std::span<const BoundaryFaceId> faces, const LeafCriteria& criteria) {
  start(criteria);
  for (std::size_t k = 0; k < faces.size(); ++k) {
    if (k % 32 == 0) criteria_.cancel.throw_if_cancelled();
    const std::uint32_t root = tree_.root(faces[k]);
    if (is_dropped(tree_.node(root))) continue;
    for (const std::uint32_t middle : tree_.coarser_middles(faces[k])) mark(middle);
    collect_node(root);
  }
}

void ContourLeaves::collect_node(std::uint32_t id) {
  if (is_dropped(tree_.node(id))) return;
  if (++visited_ % kNodesPerPoll == 0) criteria_.cancel.throw_if_cancelled();
  if (tree_.node(id).remainder) {
    // Whether or not it turns out to be a leaf: what is dropped must not depend on what is known of it.
    tree_.children(id);
    if (is_dropped(tree_.node(id))) return;
  }
  const SurfaceNode& node = tree_.examine(id);
  if (node.remainder ? accept_remainder(id, node) : accept(id, node)) return;
  // Marked vertices part the sides of coarser neighbours as well, so that both see the same edges.
  for (const std::uint32_t middle : node.middles) mark(middle);
  const std::uint32_t first = tree_.children(id);
  for (std::uint32_t k = 0; k < 4; ++k) collect_node(first + k);
}

/// A leaf's arc has to be near the surface: one that is followed is, a single chord if the chord bound says so. And no
/// loop may hide in the leaf, nor a side be crossed twice, unless it is smaller than the loops that count, or lies in
/// the plane. The smallest boxes are taken as they are.
bool ContourLeaves::accept(std::uint32_t id, const SurfaceNode& node) {
  const bool smallest = node.box.size <= kSmallestBox;
  const bool simple = node.level_lines != LevelLines::kUnknown && is_simple(id, node);
  const bool followed = simple && node.level_lines != LevelLines::kOpen;
  if (!followed && !smallest && node.chord.whole() > criteria_.tolerance_mm) return false;
  const bool resolved = simple || lies_in_plane(node);
  if (!resolved && !smallest && node.diagonal > criteria_.small_mm) return false;
  add(id, resolved);
  return true;
}

bool ContourLeaves::accept_remainder(std::uint32_t id, const SurfaceNode& node) {
  const bool root = node.box.size == kSurfaceOne;
  if (root || (node.diagonal > small_remainder_mm_ && node.box.size > kSmallestBox)) return false;
  tree_.stand_in(id);
  add(id, true);
  return true;
}

void ContourLeaves::add(std::uint32_t id, bool resolved) {
  leaves_.push_back({id, resolved});
  const SurfaceNode& node = tree_.node(id);
  const NetCoefficients& z = tree_.net(id).z;
  for (int k = 0; k < 4; ++k) {
    Mark& known = mark(node.corners[k]);
    if (known.side == PlaneSide::kUnknown) known.side = raw_side(z[kNetCorner[k]]);
  }
}

bool ContourLeaves::is_dropped(const SurfaceNode& node) const {
  return node.low > criteria_.height_mm + criteria_.margin_mm || node.high < criteria_.height_mm - criteria_.margin_mm;
}

/// Each side meets the plane at most once, and at most two do.
bool ContourLeaves::is_simple(std::uint32_t id, const SurfaceNode& node) const {
  const BezierNet& net = tree_.net(id);
  int crossings = 0;
  for (int k = 0; k < 4; ++k) {
    const PlaneSide begin = raw_side(net.z[kNetCorner[k]]);
    crossings += begin != raw_side(net.z[kNetCorner[(k + 1) % 4]]);
    if (node.monotone_sides >> k & 1) continue;
    const std::array<double, 4> z = side_curve(net, k).z;
    if (!std::all_of(z.begin(), z.end(), [&](double height) { return raw_side(height) == begin; })) return false;
  }
  return crossings <= 2;
}

/// To within rounding: the signs of such heights are noise, and halving finds nothing but more of it.
bool ContourLeaves::lies_in_plane(const SurfaceNode& node) const {
  const double far = 2 * criteria_.margin_mm;
  return node.high - criteria_.height_mm <= far && node.low - criteria_.height_mm >= -far;
}

ContourLeaves::Mark& ContourLeaves::mark(std::uint32_t vertex) {
  if (vertex >= marks_.size()) marks_.resize(tree_.vertices().size());
  Mark& mark = marks_[vertex];
  if (mark.layer != layer_) mark = {layer_, PlaneSide::kUnknown};
  return mark;
}

}  // namespace ccslice
