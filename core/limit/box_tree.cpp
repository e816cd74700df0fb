// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/limit/box_tree.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace ccslice {

template <typename Number>
class BasicBoxTree<Number>::Builder {
 public:
  Builder(BasicBoxTree& tree, std::span<const Box3> boxes, const CancellationToken& cancel)
      : tree_(tree), boxes_(boxes), cancel_(cancel), items_(boxes.size()) {
    std::iota(items_.begin(), items_.end(), 0u);
    tree_.branches_.resize(boxes.size());
    tree_.nodes_.reserve(node_count(boxes.size()));
  }

  void run() {
    if constexpr (!kIsExact) set_origin();
    add_node(items_);
  }

 private:
  void set_origin() {
    Box3 all;
    for (const Box3& box : boxes_) all.extend(box);
    const double farthest = all.min().cwiseAbs().cwiseMax(all.max().cwiseAbs()).maxCoeff();
    if (std::isfinite(farthest)) {
      tree_.origin_ = all.center();
      tree_.slack_ = static_cast<float>(4 * std::numeric_limits<double>::epsilon() * farthest);
    }
    tree_.slack_ = std::max(tree_.slack_, std::numeric_limits<float>::min());
  }

  /// Items of each of a node's full branches: a power of kLanes.
  static std::size_t items_of_branch(std::size_t items) {
    std::size_t most = 1;
    while (most * kLanes < items) most *= kLanes;
    return most;
  }

  /// Of the node that has so many items, and all below it. A full branch of n items has (n - 1) / (kLanes - 1).
  static std::size_t node_count(std::size_t items) {
    std::size_t count = 0;
    for (std::size_t left = items; left > 1 || count == 0;) {
      const std::size_t most = items_of_branch(left);
      count += 1 + left / most * ((most - 1) / (kLanes - 1));
      left %= most;
    }
    return count;
  }

  /// Full branches, one that holds what is left, and so on: the depth is logarithmic, whatever the boxes.
  std::uint32_t add_node(std::span<std::uint32_t> items) {
    cancel_.throw_if_cancelled();
    constexpr Number kNone = std::numeric_limits<Number>::quiet_NaN();
    const auto index = static_cast<std::uint32_t>(tree_.nodes_.size());
    Node& node = tree_.nodes_.emplace_back();
    node.min.fill(Four{kNone, kNone, kNone, kNone});
    node.max = node.min;
    std::size_t branches = 0;
    add_branches(items, items_of_branch(items.size()), index, branches);
    return index;
  }

  /// Cuts along the longest extent of the boxes' middles.
  void add_branches(std::span<std::uint32_t> items, std::size_t most, std::uint32_t node, std::size_t& branch) {
    if (items.size() <= most) return add_branch(items, node, branch++);
    Box3 centres;
    for (const std::uint32_t item : items) centres.extend(boxes_[item].center());
    Eigen::Index axis = 0;
    centres.sizes().maxCoeff(&axis);
    const std::size_t first = items.size() > 2 * most ? 2 * most : most;
    std::nth_element(items.begin(), items.begin() + static_cast<std::ptrdiff_t>(first), items.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const double ca = boxes_[a].center()[axis], cb = boxes_[b].center()[axis];
                       return ca != cb ? ca < cb : a < b;
                     });
    add_branches(items.first(first), most, node, branch);
    add_branches(items.subspan(first), most, node, branch);
  }

  void add_branch(std::span<std::uint32_t> items, std::uint32_t node, std::size_t branch) {
    Box3 box;
    for (const std::uint32_t item : items) box.extend(boxes_[item]);
    const Bounds bounds = tree_.rounded(box);
    for (std::size_t a = 0; a < 3; ++a) {
      tree_.nodes_[node].min[a][branch] = bounds.min[a];
      tree_.nodes_[node].max[a][branch] = bounds.max[a];
    }
    if (items.size() == 1) {
      tree_.branches_[items.front()] = static_cast<std::uint32_t>(node * kLanes + branch);
      tree_.nodes_[node].branches[branch] = kItem | items.front();
    } else {
      const std::uint32_t below = add_node(items);
      tree_.nodes_[node].branches[branch] = below;
    }
  }

  BasicBoxTree& tree_;
  const std::span<const Box3> boxes_;
  const CancellationToken& cancel_;
  std::vector<std::uint32_t> items_;
};

template <typename Number>
BasicBoxTree<Number>::BasicBoxTree(std::span<const Box3> boxes, const CancellationToken& cancel) {
  if (boxes.empty()) return;
  Builder(*this, boxes, cancel).run();
}

template <typename Number>
Box3 BasicBoxTree<Number>::box(std::uint32_t item) const {
  const Node& node = nodes_[branches_[item] / kLanes];
  const std::size_t b = branches_[item] % kLanes;
  return Box3(origin_ + Vec3(node.min[0][b], node.min[1][b], node.min[2][b]),
              origin_ + Vec3(node.max[0][b], node.max[1][b], node.max[2][b]));
}

template class BasicBoxTree<double>;
template class BasicBoxTree<float>;

}  // namespace ccslice
