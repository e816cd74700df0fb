// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/contour_stitcher.h"

#include <algorithm>
#include <utility>

#include "core/base/error.h"

namespace ccslice {

void ContourStitcher::clear() {
  crossings_.clear();
  segments_.clear();
}

void ContourStitcher::add_segment(std::uint32_t from, std::uint32_t to) {
  const auto id = static_cast<std::uint32_t>(segments_.size());
  segments_.push_back({from, to});
  for (const std::uint32_t end : {from, to}) {
    auto& ends = crossings_[end].segments;
    std::uint32_t& free = ends[0] == kNone ? ends[0] : ends[1];
    if (free != kNone) throw Error(ErrorCode::kInternal, "a contour forks");
    free = id;
  }
}

std::vector<ContourLoop> ContourStitcher::loops(double repeated_mm) const {
  std::vector<ContourLoop> loops;
  std::vector<bool> visited(crossings_.size());
  std::vector<std::uint32_t> path;
  for (std::uint32_t start = 0; start < crossings_.size(); ++start) {
    if (visited[start]) continue;
    path.clear();
    follow(start, path, visited);
    ContourLoop loop = loop_of(path, repeated_mm);
    if (loop.points.size() >= 3) loops.push_back(std::move(loop));
  }
  return loops;
}

void ContourStitcher::follow(std::uint32_t start, std::vector<std::uint32_t>& path, std::vector<bool>& visited) const {
  std::int64_t along = 0;
  std::uint32_t at = start, segment = crossings_[start].segments[0];
  do {
    if (segment == kNone) throw Error(ErrorCode::kInternal, "a contour doesn't close");
    path.push_back(at);
    visited[at] = true;
    const bool forward = segments_[segment].from == at;
    along += forward ? 1 : -1;
    at = forward ? segments_[segment].to : segments_[segment].from;
    const auto& ends = crossings_[at].segments;
    segment = ends[0] == segment ? ends[1] : ends[0];
  } while (at != start);
  if (along < 0) std::reverse(path.begin() + 1, path.end());
}

ContourLoop ContourStitcher::loop_of(const std::vector<std::uint32_t>& path, double repeated_mm) const {
  ContourLoop loop;
  auto& points = loop.points;
  const auto repeats = [=](const ContourPoint& a, const ContourPoint& b) {
    return (a.xy - b.xy).norm() <= repeated_mm;
  };
  for (const std::uint32_t crossing : path) {
    const ContourPoint& point = crossings_[crossing].point;
    if (points.empty() || !repeats(point, points.back())) points.push_back(point);
  }
  while (points.size() > 1 && repeats(points.back(), points.front())) points.pop_back();
  return loop;
}

}  // namespace ccslice
