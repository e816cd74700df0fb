// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_maps.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace ccslice::oracle {
namespace {

constexpr double kRoundingOfValues = 0x1p-21;  // Of floats, those of stops included.
constexpr std::size_t kMostPlaces = 1000;      // In a box of values. Of larger ones nothing is said.

}  // namespace

double steepest_span_of(const MaterialMap& map) {
  double span = std::numeric_limits<double>::infinity();
  if (std::holds_alternative<DirectMap>(map.kind)) return 1;
  if (const auto* colour = std::get_if<ColourMap>(&map.kind)) return colour->full_value;
  if (const auto* blend = std::get_if<BlendMap>(&map.kind)) {
    for (std::size_t i = 1; i < blend->stops.size(); ++i) {
      span = std::min(span, blend->stops[i].value - blend->stops[i - 1].value);
    }
  }
  if (const auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    for (std::size_t i = 1; i < curve->points.size(); ++i) {
      const CalibrationMap::Point &a = curve->points[i - 1], &b = curve->points[i];
      span = std::min(span, (b.property - a.property) / std::abs(b.fraction - a.fraction));
    }
  }
  return span;
}

namespace {

/// In the map's order, then one for each override. One that is several components of a colour is there as often: mixes
/// are linear in each component but not along a diagonal, so that bounds need each by itself.
std::vector<std::string> inputs_of(const MaterialMap& map) {
  std::vector<std::string> inputs = kind_channels_of(map);
  if (const auto* colour = std::get_if<ColourMap>(&map.kind)) inputs = {colour->red, colour->green, colour->blue};
  for (const MapOverride& own : map.overrides) inputs.push_back(own.channel);
  return inputs;
}

}  // namespace

MapTruth::MapTruth(const Printing& printing, const MaterialMap& map, std::shared_ptr<const ColourTable> colours)
    : map_(map), materials_(printing.materials.size()), colours_(std::move(colours)), channels_(inputs_of(map)) {
  if (const auto* blend = std::get_if<BlendMap>(&map.kind)) {
    for (const BlendMap::Stop& stop : blend->stops) {
      stops_.push_back(stop.value);
      stop_shares_.emplace_back().fill(0);
      stop_shares_.back()[stop.material - 1] = 1;
    }
  }
  if (const auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    for (const CalibrationMap::Point& point : curve->points) {
      stops_.push_back(point.property);
      stop_shares_.emplace_back().fill(0);
      stop_shares_.back()[curve->material - 1] = point.fraction;
      stop_shares_.back()[curve->base - 1] = 1 - point.fraction;
    }
  }
}

MixBounds MapTruth::bounds(std::span<const Interval> values) const {
  MixBounds bounds;
  std::vector<std::vector<double>> places;
  std::size_t count = 1;
  for (const Interval& value : values) {
    double size = std::max(std::abs(value.low), std::abs(value.high));
    for (const double stop : stops_) size = std::max(size, std::abs(stop));
    const double rounding = kRoundingOfValues * size;
    const Interval wide{value.low - rounding, value.high + rounding};
    places.push_back({wide.low, wide.high});
    add_kinks(wide, places.back());
    count *= places.back().size();
  }
  const bool all = count > kMostPlaces;
  bounds.shares.fill(all ? Interval{0, 1} : Interval{1, 0});
  bounds.sums.fill(all ? Interval{0, 1} : Interval{1, 0});
  std::vector<double> at(values.size());
  for (std::size_t i = 0; i < count && !all; ++i) {
    std::size_t left = i;
    for (std::size_t c = 0; c < places.size(); left /= places[c++].size()) at[c] = places[c][left % places[c].size()];
    const Shares mix = overridden(shares(at), std::span(at).last(map_.overrides.size()));
    double sum = 0;
    const auto widen = [](Interval& interval, double value) {
      interval.low = std::min(interval.low, std::max(0.0, value - kRoundingOfShares));
      interval.high = std::max(interval.high, value + kRoundingOfShares);
    };
    bounds.sums[0] = {0, 0};
    for (std::size_t m = 0; m < materials_; ++m) {
      widen(bounds.shares[m], mix[m]);
      widen(bounds.sums[m + 1], sum += mix[m]);
    }
  }
  return bounds;
}

void MapTruth::add_kinks(const Interval& within, std::vector<double>& places) const {
  const auto add = [&](double place) {
    if (within.low < place && place < within.high) places.push_back(place);
  };
  for (const double stop : stops_) add(stop);
  const auto* colour = std::get_if<ColourMap>(&map_.kind);
  if (colour == nullptr) return;
  constexpr double kSteps = ColourTable::kNodes - 1;
  for (double node = 0; node <= kSteps; ++node) add(node / kSteps * colour->full_value);
}

MapTruth::Shares MapTruth::shares(std::span<const double> values) const {
  if (const auto* direct = std::get_if<DirectMap>(&map_.kind)) return direct_shares(*direct, values);
  if (const auto* colour = std::get_if<ColourMap>(&map_.kind)) return colour_shares(*colour, values);
  if (!stops_.empty()) return table_shares(values.front());
  Shares shares{};
  const auto* pure = std::get_if<PureMap>(&map_.kind);
  shares[pure != nullptr ? pure->material - 1 : 0] = 1;
  return shares;
}

/// `values`: those that the overrides compare.
MapTruth::Shares MapTruth::overridden(Shares shares, std::span<const double> values) const {
  const std::vector<MapOverride>& all = map_.overrides;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].instead_of != 0 || values[i] >= all[i].below) continue;
    shares.fill(0);
    shares[all[i].material - 1] = 1;
    break;
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].instead_of == 0 || values[i] >= all[i].below) continue;
    shares[all[i].material - 1] += shares[all[i].instead_of - 1];
    shares[all[i].instead_of - 1] = 0;
  }
  return shares;
}

/// Linear between stops, held at the ends.
MapTruth::Shares MapTruth::table_shares(double value) const {
  const auto above = static_cast<std::size_t>(std::ranges::upper_bound(stops_, value) - stops_.begin());
  if (above == 0) return stop_shares_.front();
  if (above == stops_.size()) return stop_shares_.back();
  const double along = (value - stops_[above - 1]) / (stops_[above] - stops_[above - 1]);
  Shares shares{};
  for (std::size_t m = 0; m < materials_; ++m) {
    shares[m] = (1 - along) * stop_shares_[above - 1][m] + along * stop_shares_[above][m];
  }
  return shares;
}

MapTruth::Shares MapTruth::direct_shares(const DirectMap& map, std::span<const double> values) const {
  Shares shares{};
  double sum = 0;
  for (std::size_t i = 0; i < map.shares.size(); ++i) {
    const std::uint32_t material = map.shares[i].material - 1;
    shares[material] = std::max(0.0, values[i]);
    sum += shares[material];
  }
  if (map.rest_material != 0) {
    shares[map.rest_material - 1] = std::max(0.0, 1 - sum);
    sum = std::max(sum, 1.0);
  }
  if (sum == 0) shares[map.shares.front().material - 1] = sum = 1;
  for (double& share : shares) share /= sum;
  return shares;
}

MapTruth::Shares MapTruth::colour_shares(const ColourMap& map, std::span<const double> values) const {
  constexpr double kSteps = ColourTable::kNodes - 1;
  std::array<float, 3> at;
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = static_cast<float>(std::clamp(values[i] / map.full_value * kSteps, 0.0, kSteps));
  }
  const ColourTable::Weights weights = colours_->weights(at);
  return {weights[0], weights[1], weights[2], weights[3], weights[4], weights[5], weights[6], weights[7]};
}

}  // namespace ccslice::oracle
