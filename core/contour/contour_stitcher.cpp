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
  between_.clear();
}

void ContourStitcher::add_segment(std::uint32_t from, std::uint32_t to) {
  const auto id = static_cast<std::uint32_t>(segments_.size());
  segments_.push_back({from, to, id == 0 ? 0 : segments_.back().end, between_.size()});
  for (const std::uint32_t end : {from, to}) {
    auto& ends = crossings_[end].segments;
    std::uint32_t& free = ends[0] == kNone ? ends[0] : ends[1];
    if (free != kNone) throw Error(ErrorCode::kInternal, "a contour forks");
    free = id;
  }
}

template <typename Visit>
void ContourStitcher::for_each_loop(const Visit& visit) {
  visited_.assign(crossings_.size(), false);
  for (std::uint32_t start = 0; start < crossings_.size(); ++start) {
    if (visited_[start] || crossings_[start].segments[0] == kNone) continue;
    follow(start);
    visit();
  }
}

std::vector<ContourLoop> ContourStitcher::loops(double repeated_mm) {
  std::vector<ContourLoop> loops;
  for_each_loop([&] {
    ContourLoop loop = loop_of_path(repeated_mm);
    if (loop.points.size() >= 3) loops.push_back(std::move(loop));
  });
  return loops;
}

std::vector<bool> ContourStitcher::segments_against() {
  std::vector<bool> against(segments_.size());
  for_each_loop([&] {
    for (const Step& step : path_) against[step.segment] = !step.forward;
  });
  return against;
}

void ContourStitcher::follow(std::uint32_t start) {
  path_.clear();
  std::int64_t along = 0;
  std::uint32_t at = start, segment = crossings_[start].segments[0];
  do {
    if (segment == kNone) throw Error(ErrorCode::kInternal, "a contour doesn't close");
    visited_[at] = true;
    const bool forward = segments_[segment].from == at;
    path_.push_back({segment, forward});
    along += forward ? 1 : -1;
    at = forward ? segments_[segment].to : segments_[segment].from;
    const auto& ends = crossings_[at].segments;
    segment = ends[0] == segment ? ends[1] : ends[0];
  } while (at != start);
  if (along >= 0) return;
  std::reverse(path_.begin(), path_.end());
  for (Step& step : path_) step.forward = !step.forward;
}

ContourLoop ContourStitcher::loop_of_path(double repeated_mm) const {
  ContourLoop loop;
  auto& points = loop.points;
  std::size_t most = path_.size();
  for (const Step& step : path_) most += segments_[step.segment].end - segments_[step.segment].begin;
  points.reserve(most);
  const auto repeats = [=](const ContourPoint& a, const ContourPoint& b) {
    return (a.xy - b.xy).squaredNorm() <= repeated_mm * repeated_mm;
  };
  const auto append = [&](const ContourPoint& point) {
    if (points.empty() || !repeats(point, points.back())) points.push_back(point);
  };
  for (const auto& [id, forward] : path_) {
    const Segment& segment = segments_[id];
    append(crossings_[forward ? segment.from : segment.to].point);
    for (std::size_t k = segment.begin; k < segment.end; ++k) {
      append(between_[forward ? k : segment.begin + segment.end - 1 - k]);
    }
  }
  while (points.size() > 1 && repeats(points.back(), points.front())) points.pop_back();
  return loop;
}

}  // namespace ccslice
