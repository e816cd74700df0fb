// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/orient_regions.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/contour/contour_stitcher.h"

namespace ccslice {
namespace {

/// Which segments run against most of their line, seen from the region on their left and from that on their right.
struct Turned {
  std::vector<bool> left, right;
};

class RegionOrienter {
 public:
  RegionOrienter(std::span<const RegionSegment> segments, std::size_t crossings, std::span<const RegionEdge> edges)
      : segments_(segments), edges_(edges), numbers_(crossings, kNone) {
    turned_.left.resize(segments.size());
    turned_.right.resize(segments.size());
    std::array<std::vector<std::uint32_t>, kNoCellRegion> of_regions;
    for (std::uint32_t s = 0; s < segments.size(); ++s) {
      const RegionEdge& edge = edges[segments[s].begin];
      if (edge.left != kNoCellRegion) of_regions[edge.left].push_back(s);
      if (edge.right != kNoCellRegion) of_regions[edge.right].push_back(s);
    }
    for (std::size_t region = 0; region < kNoCellRegion; ++region) {
      if (!of_regions[region].empty()) turn(static_cast<std::uint8_t>(region), of_regions[region]);
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
  static constexpr std::uint32_t kNone = ~std::uint32_t{0};

  /// Where one of a region's segments ends.
  struct End {
    std::uint32_t crossing;
    std::uint32_t point = 0;  // Of the lines to stitch: a crossing for each two ends that meet there.
    double angle = 0;         // In which the segment leaves it.
  };

  double angle_at(const RegionSegment& segment, bool at_end) const {
    const auto count = segment.end - segment.begin;
    for (std::size_t n = 0; n < count; ++n) {
      const RegionEdge& edge = edges_[at_end ? segment.end - 1 - n : segment.begin + n];
      const Vec2 along = at_end ? Vec2(edge.from - edge.to) : Vec2(edge.to - edge.from);
      if (along != Vec2::Zero()) return std::atan2(along.y(), along.x());
    }
    return 0;
  }

  /// Two ends for each of the segments. Where more than two meet, as where a region touches itself in an edge, those
  /// that follow each other round the crossing belong together: so lines touch there, and don't cross.
  /// Returns how many points there are, or nothing if some end is alone.
  std::optional<std::uint32_t> join_ends(std::vector<End>& ends) {
    std::vector<std::vector<std::uint32_t>> meeting;
    for (std::uint32_t e = 0; e < ends.size(); ++e) {
      std::uint32_t& number = numbers_[ends[e].crossing];
      if (number == kNone) {
        number = static_cast<std::uint32_t>(meeting.size());
        meeting.emplace_back();
      }
      meeting[number].push_back(e);
    }
    for (const End& end : ends) numbers_[end.crossing] = kNone;
    std::uint32_t points = 0;
    for (std::vector<std::uint32_t>& here : meeting) {
      if (here.size() % 2 != 0) return std::nullopt;
      std::ranges::stable_sort(here, {}, [&](std::uint32_t e) { return ends[e].angle; });
      for (std::size_t k = 0; k < here.size(); ++k) ends[here[k]].point = points + static_cast<std::uint32_t>(k / 2);
      points += static_cast<std::uint32_t>(here.size() / 2);
    }
    return points;
  }

  /// Finds the segments of one region that run against most of their line.
  void turn(std::uint8_t region, const std::vector<std::uint32_t>& segments) {
    std::vector<End> ends;
    for (const std::uint32_t s : segments) {
      ends.push_back({segments_[s].from, 0, angle_at(segments_[s], false)});
      ends.push_back({segments_[s].to, 0, angle_at(segments_[s], true)});
    }
    const std::optional<std::uint32_t> points = join_ends(ends);
    if (!points) return;
    ContourStitcher lines;
    for (std::uint32_t p = 0; p < *points; ++p) lines.add_crossing({});
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const bool is_left = edges_[segments_[segments[i]].begin].left == region;
      const std::uint32_t from = ends[2 * i].point, to = ends[2 * i + 1].point;
      lines.add_segment(is_left ? from : to, is_left ? to : from);
    }
    const std::vector<bool> against = lines.segments_against();
    for (std::size_t i = 0; i < segments.size(); ++i) {
      const bool is_left = edges_[segments_[segments[i]].begin].left == region;
      (is_left ? turned_.left : turned_.right)[segments[i]] = against[i];
    }
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
  std::span<const RegionEdge> edges_;
  std::vector<std::uint32_t> numbers_;  // Of crossings among those of a region, while its ends are joined.
  Turned turned_;
};

}  // namespace

void orient_regions(std::span<const RegionSegment> segments, std::size_t crossings, std::vector<RegionEdge>& edges) {
  edges = RegionOrienter(segments, crossings, edges).edges();
}

}  // namespace ccslice
