// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/tray/pack_tray.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numeric>
#include <optional>

namespace ccslice::cli {
namespace {

/// Rounding of sums: what is wider by less still fits.
constexpr double kRoundingMm = 1e-9;

class Skyline {
 public:
  explicit Skyline(double width) : width_(width), steps_{{0, 0}} {}

  struct Spot {
    double x = 0, y = 0;
  };

  /// The lowest place for something of this width, and leftmost of those.
  std::optional<Spot> lowest(double width) const {
    std::optional<Spot> best;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      if (steps_[i].x + width > width_ + kRoundingMm) break;
      const double y = height_over(i, width);
      if (!best || y < best->y - kRoundingMm) best = Spot{steps_[i].x, y};
    }
    return best;
  }

  void put(const Spot& spot, double width, double depth) {
    const double end = spot.x + width;
    std::vector<Spot> steps;
    double behind = 0;  // The height where the new step ends.
    for (const Spot& step : steps_) {
      if (step.x <= end + kRoundingMm) behind = step.y;
      if (step.x < spot.x - kRoundingMm || step.x > end + kRoundingMm) steps.push_back(step);
    }
    const auto at = std::ranges::find_if(steps, [&](const Spot& step) { return step.x >= spot.x; });
    const auto put_at = steps.insert(at, {spot.x, spot.y + depth});
    if (end < width_ - kRoundingMm) steps.insert(put_at + 1, {end, behind});
    steps_ = std::move(steps);
  }

 private:
  double height_over(std::size_t first, double width) const {
    double height = 0;
    for (std::size_t i = first; i < steps_.size() && steps_[i].x < steps_[first].x + width - kRoundingMm; ++i) {
      height = std::max(height, steps_[i].y);
    }
    return height;
  }

  const double width_;
  std::vector<Spot> steps_;  // By x: from here to the next one the skyline is so high.
};

PackedTray pack_in_order(const std::vector<Footprint>& footprints, const std::vector<std::size_t>& order, double width,
                         double clearance) {
  Skyline skyline(width + clearance);
  PackedTray tray;
  tray.places.resize(footprints.size());
  for (const std::size_t i : order) {
    const double w = footprints[i].width_mm + clearance, d = footprints[i].depth_mm + clearance;
    const std::optional<Skyline::Spot> straight = skyline.lowest(w), turned = skyline.lowest(d);
    const bool turn = turned && (!straight || turned->y + w < straight->y + d - kRoundingMm);
    const Skyline::Spot spot = turn ? *turned : straight.value_or(Skyline::Spot());
    skyline.put(spot, turn ? d : w, turn ? w : d);
    tray.places[i] = {spot.x, spot.y, turn};
    tray.depth_mm = std::max(tray.depth_mm, spot.y + (turn ? w : d) - clearance);
  }
  return tray;
}

}  // namespace

PackedTray pack_tray(const std::vector<Footprint>& footprints, double width_mm, double clearance_mm) {
  using Size = std::function<double(const Footprint&)>;
  const Size longest = [](const Footprint& it) { return std::max(it.width_mm, it.depth_mm); };
  const Size shortest = [](const Footprint& it) { return std::min(it.width_mm, it.depth_mm); };
  const Size area = [](const Footprint& it) { return it.width_mm * it.depth_mm; };
  const Size depth = [](const Footprint& it) { return it.depth_mm; };
  PackedTray best;
  best.depth_mm = std::numeric_limits<double>::infinity();
  for (const Size& size : {longest, shortest, area, depth}) {
    std::vector<std::size_t> order(footprints.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, std::greater<>(), [&](std::size_t i) { return size(footprints[i]); });
    PackedTray tray = pack_in_order(footprints, order, width_mm, clearance_mm);
    if (tray.depth_mm < best.depth_mm) best = std::move(tray);
  }
  return best;
}

}  // namespace ccslice::cli
