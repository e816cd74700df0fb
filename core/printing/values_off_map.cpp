// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/values_off_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <variant>

#include "core/channel/channel_table.h"
#include "core/channel/channel_values.h"
#include "core/limit/limit_evaluator.h"
#include "core/limit/solid_sampler.h"

namespace ccslice {
namespace {

std::optional<std::array<double, 2>> covered_by(const MaterialMap& map) {
  if (const auto* blend = std::get_if<BlendMap>(&map.kind)) {
    if (blend->stops.size() < 2) return std::nullopt;
    return std::array{blend->stops.front().value, blend->stops.back().value};
  }
  if (const auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    if (curve->points.size() < 2) return std::nullopt;
    return std::array{curve->points.front().property, curve->points.back().property};
  }
  if (const auto* colour = std::get_if<ColourMap>(&map.kind)) return std::array{0.0, colour->full_value};
  if (std::holds_alternative<DirectMap>(map.kind)) return std::array{0.0, 1.0};
  return std::nullopt;
}

bool is_off(double value, const std::array<double, 2>& covered) {
  const double slack = kStrictSlack * (covered[1] - covered[0]);
  return !(value >= covered[0] - slack && value <= covered[1] + slack);
}

/// Which of maps_of() a region's voxels take.
std::size_t map_of(const Printing& printing, std::uint8_t region) {
  const auto own = std::ranges::find(printing.cell_region_maps, region, &CellRegionMap::cell_region);
  if (own == printing.cell_region_maps.end()) return 0;
  return 1 + static_cast<std::size_t>(own - printing.cell_region_maps.begin());
}

/// The solid's channels that a direct map without a material for the rest has the shares of; none of other maps, and of
/// those with overrides, which may be where the fractions don't add up.
std::vector<std::uint32_t> shares_alone(const MaterialMap& map, const ChannelTable& table) {
  const auto* direct = std::get_if<DirectMap>(&map.kind);
  std::vector<std::uint32_t> shares;
  if (direct == nullptr || direct->rest_material != 0 || !map.overrides.empty()) return shares;
  for (const DirectMap::Share& share : direct->shares) {
    const std::optional<Channel> channel = table.find(share.channel);
    if (!channel) return {};
    shares.push_back(*channel->of_solid);
  }
  return shares;
}

/// ValueOf: of a share's channel.
template <typename ValueOf>
double sum_of_shares(std::span<const std::uint32_t> shares, const ValueOf& value_of) {
  double sum = 0;
  for (const std::uint32_t channel : shares) sum += std::max(0.0, value_of(channel));
  return sum;
}

}  // namespace

std::vector<ValuesOffMap> find_values_off_maps(const Printing& printing, const LimitSolid& solid,
                                               const ChannelSources& sources, const Placement& placement) {
  const std::vector<const MaterialMap*> maps = maps_of(printing);
  const ChannelValues all(solid.summary().channels, sources);
  std::vector<ValuesOffMap> found;
  std::vector<std::size_t> channel_of;  // By number of what is found.
  for (const MaterialMap* map : maps) {
    const auto covered = covered_by(*map);
    if (!covered) continue;
    for (const std::string& name : kind_channels_of(*map)) {
      const auto channel = std::ranges::find(all.channels(), name, &ChannelRange::name);
      if (!is_off(channel->min, *covered) && !is_off(channel->max, *covered)) continue;
      found.push_back({map, *channel, *covered, 0});
      channel_of.push_back(static_cast<std::size_t>(channel - all.channels().begin()));
    }
  }
  if (found.empty()) return found;
  std::vector<double> channels(all.channels().size()), volumes(maps.size());
  SolidSampler(solid).run([&](LimitEvaluator& evaluator, const CellParam& at, double volume) {
    const std::size_t map = map_of(printing, solid.region_of(solid.control_cell(at.cell)));
    evaluator.mat(at, std::span(channels).first(solid.channel_count()));
    if (!sources.empty()) {
      const Vec3 mesh = evaluator.geo(at);
      all.complete(placement * mesh, mesh, channels);
    }
    volumes[map] += volume;
    const bool is_overridden = std::ranges::any_of(maps[map]->overrides, [&](const MapOverride& first) {
      const auto channel = std::ranges::find(all.channels(), first.channel, &ChannelRange::name);
      return channels[static_cast<std::size_t>(channel - all.channels().begin())] < first.below;
    });
    if (is_overridden) return;
    for (std::size_t i = 0; i < found.size(); ++i) {
      ValuesOffMap& off = found[i];
      if (off.map == maps[map] && is_off(channels[channel_of[i]], off.covered)) off.share += volume;
    }
  });
  for (ValuesOffMap& off : found) {
    const auto map = static_cast<std::size_t>(std::ranges::find(maps, off.map) - maps.begin());
    off.share = volumes[map] > 0 ? off.share / volumes[map] : 0;
  }
  std::erase_if(found, [](const ValuesOffMap& off) { return off.share == 0; });
  return found;
}

std::vector<FractionsBelowOne> find_fractions_below_one(const Printing& printing, const LimitSolid& solid) {
  constexpr double kLeast = 1 - kStrictSlack;
  const std::vector<const MaterialMap*> maps = maps_of(printing);
  const std::vector<ChannelRange>& ranges = solid.summary().channels;
  const ChannelTable table(ranges);
  std::vector<FractionsBelowOne> found(maps.size());
  std::vector<std::vector<std::uint32_t>> shares;  // By map.
  bool some = false;
  for (std::size_t i = 0; i < maps.size(); ++i) {
    shares.push_back(shares_alone(*maps[i], table));
    if (shares[i].empty()) continue;
    if (sum_of_shares(shares[i], [&](std::uint32_t channel) { return ranges[channel].min; }) >= kLeast) continue;
    found[i].map = maps[i];
    some = true;
  }
  if (!some) return {};
  std::vector<double> channels(ranges.size()), volumes(maps.size());
  SolidSampler(solid).run([&](LimitEvaluator& evaluator, const CellParam& at, double volume) {
    const std::size_t map = map_of(printing, solid.region_of(solid.control_cell(at.cell)));
    volumes[map] += volume;
    if (found[map].map == nullptr) return;
    evaluator.mat(at, channels);
    const double sum = sum_of_shares(shares[map], [&](std::uint32_t channel) { return channels[channel]; });
    if (sum >= kLeast) return;
    found[map].share += volume;
    found[map].least_sum = std::min(found[map].least_sum, sum);
  });
  for (std::size_t i = 0; i < maps.size(); ++i) {
    if (volumes[i] > 0) found[i].share /= volumes[i];
  }
  std::erase_if(found, [](const FractionsBelowOne& below) { return below.share == 0; });
  return found;
}

}  // namespace ccslice
