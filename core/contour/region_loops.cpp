// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/region_loops.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <tuple>

#include "core/base/error.h"

namespace ccslice {
namespace {

/// An edge with its region to the left.
struct SideEdge {
  std::uint8_t region;
  Vec2 from, to;
};

std::tuple<std::uint8_t, double, double> start_of(const SideEdge& edge) {
  return {edge.region, edge.from.x(), edge.from.y()};
}

/// As many edges of a region end in each point as begin there. So a walk along edges that haven't been taken comes back
/// to where it began.
class LoopJoiner {
 public:
  explicit LoopJoiner(std::span<const RegionEdge> edges) {
    for (const RegionEdge& edge : edges) {
      if (edge.left == edge.right || edge.from == edge.to) continue;
      if (edge.left != kNoCellRegion) edges_.push_back({edge.left, edge.from, edge.to});
      if (edge.right != kNoCellRegion) edges_.push_back({edge.right, edge.to, edge.from});
    }
    std::ranges::sort(edges_, {}, [](const SideEdge& edge) {
      return std::tuple_cat(start_of(edge), std::tuple(edge.to.x(), edge.to.y()));
    });
    taken_.resize(edges_.size());
  }

  std::vector<RegionLoop> join(const CancellationToken& cancel) {
    std::vector<RegionLoop> loops;
    for (std::size_t first = 0; first < edges_.size(); ++first) {
      if (taken_[first]) continue;
      cancel.throw_if_cancelled();
      loops.push_back(loop_from(first));
    }
    return loops;
  }

 private:
  RegionLoop loop_from(std::size_t first) {
    const SideEdge& begin = edges_[first];
    RegionLoop loop{begin.region, {}};
    for (std::size_t edge = first;;) {
      taken_[edge] = true;
      loop.points.push_back(edges_[edge].from);
      if (edges_[edge].to == begin.from) return loop;
      edge = next_of(edges_[edge]);
    }
  }

  std::size_t next_of(const SideEdge& edge) const {
    const std::tuple start(edge.region, edge.to.x(), edge.to.y());
    const auto found = std::ranges::lower_bound(edges_, start, {}, &start_of);
    for (auto next = static_cast<std::size_t>(found - edges_.begin()); next < edges_.size(); ++next) {
      if (start_of(edges_[next]) != start) break;
      if (!taken_[next]) return next;
    }
    throw Error(ErrorCode::kInternal, "the contours of cell region " + std::to_string(edge.region) + " don't close");
  }

  std::vector<SideEdge> edges_;
  std::vector<bool> taken_;
};

}  // namespace

std::vector<RegionLoop> join_region_loops(std::span<const RegionEdge> edges, const CancellationToken& cancel) {
  return LoopJoiner(edges).join(cancel);
}

}  // namespace ccslice
