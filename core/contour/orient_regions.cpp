// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/orient_regions.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/contour/contour_stitcher.h"

namespace ccslice {
namespace {

/// Of each segment, seen from the region on its left and from that on its right: it runs against most of its line.
struct Turned {
  std::vector<bool> left, right;
};

class RegionOrienter {
 public:
  RegionOrienter(std::span<const RegionSegment> segments, std::size_t crossings, std::span<const RegionEdge> edges)
      : segments_(segments), crossings_(crossings), edges_(edges) {
    turned_.left.resize(segments.size());
    turned_.right.resize(segments.size());
    std::array<bool, kNoCellRegion> is_there{};
    for (const RegionEdge& edge : edges) {
      for (const std::uint8_t region : {edge.left, edge.right}) {
        if (region == kNoCellRegion || std::exchange(is_there[region], true)) continue;
        turn(region);
      }
    }
  }

  std::vector<RegionEdge> edges() const {
    std::vector<RegionEdge> result;
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      for (std::size_t e = segments_[s].begin; e < segments_[s].end; ++e) add(edges_[e], s, result);
    }
    return result;
  }

 private:
  /// Each crossing ends two of a region's segments, or none.
  bool forks(std::uint8_t region) const {
    std::vector<std::uint32_t> ends(crossings_);
    for (const RegionSegment& segment : segments_) {
      const RegionEdge& edge = edges_[segment.begin];
      if (edge.left != region && edge.right != region) continue;
      ++ends[segment.from];
      ++ends[segment.to];
    }
    return std::ranges::any_of(ends, [](std::uint32_t count) { return count != 0 && count != 2; });
  }

  /// Finds the segments of one region that run against most of their line.
  void turn(std::uint8_t region) {
    if (forks(region)) return;
    ContourStitcher lines;
    for (std::size_t c = 0; c < crossings_; ++c) lines.add_crossing({});
    std::vector<std::vector<bool>::reference> turned;
    for (std::size_t s = 0; s < segments_.size(); ++s) {
      const RegionSegment& segment = segments_[s];
      if (edges_[segment.begin].left == region) {
        lines.add_segment(segment.from, segment.to);
        turned.push_back(turned_.left[s]);
      } else if (edges_[segment.begin].right == region) {
        lines.add_segment(segment.to, segment.from);
        turned.push_back(turned_.right[s]);
      }
    }
    const std::vector<bool> against = lines.segments_against();
    for (std::size_t i = 0; i < turned.size(); ++i) turned[i] = against[i];
  }

  void add(const RegionEdge& edge, std::size_t segment, std::vector<RegionEdge>& result) const {
    const bool left = turned_.left[segment], right = turned_.right[segment];
    if (edge.left == kNoCellRegion || edge.right == kNoCellRegion || left == right) {
      result.push_back(edge);
      const bool is_turned = edge.left == kNoCellRegion ? right : left;
      // The other way round the same regions are on the other sides.
      if (is_turned) std::swap(result.back().from, result.back().to);
      return;
    }
    RegionEdge of_left{edge.from, edge.to, edge.left, kNoCellRegion};
    RegionEdge of_right{edge.from, edge.to, kNoCellRegion, edge.right};
    if (left) std::swap(of_left.from, of_left.to);
    if (right) std::swap(of_right.from, of_right.to);
    result.push_back(of_left);
    result.push_back(of_right);
  }

  std::span<const RegionSegment> segments_;
  const std::size_t crossings_;
  std::span<const RegionEdge> edges_;
  Turned turned_;
};

}  // namespace

void orient_regions(std::span<const RegionSegment> segments, std::size_t crossings, std::vector<RegionEdge>& edges) {
  edges = RegionOrienter(segments, crossings, edges).edges();
}

}  // namespace ccslice
