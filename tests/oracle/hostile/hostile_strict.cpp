// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/oracle/hostile/hostile_strict.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/channel/channel_table.h"
#include "core/slicer/layer_slicer.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_maps.h"

namespace ccslice::oracle {
namespace {

constexpr double kShareOfStrictMaps = 0.3;
constexpr double kSlack = 1.0 / 128;       // As ccslice/v1/material.proto has it.
constexpr double kRoundingOfSlack = 1e-4;  // Of what a map covers, for what inversions may differ by.

void cover_range(const SolidSummary& solid, MaterialMap& map) {
  const ChannelTable channels(solid.channels);
  if (auto* blend = std::get_if<BlendMap>(&map.kind)) {
    const ChannelRange range = channels.at(blend->channel).range;
    blend->stops.front().value = std::min(blend->stops.front().value, range.min);
    blend->stops.back().value = std::max(blend->stops.back().value, range.max);
  }
  if (auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    const ChannelRange range = channels.at(curve->channel).range;
    curve->points.front().property = std::min(curve->points.front().property, range.min);
    curve->points.back().property = std::max(curve->points.back().property, range.max);
  }
  if (auto* colour = std::get_if<ColourMap>(&map.kind)) {
    for (const std::string& channel : {colour->red, colour->green, colour->blue}) {
      colour->full_value = std::max(colour->full_value, channels.at(channel).range.max);
    }
  }
}

bool is_strict(const Printing& printing) {
  return std::ranges::any_of(maps_of(printing), [](const MaterialMap* map) { return map->strict; });
}

/// Off [low, high] for certain, or maybe: values are known within bounds.
struct Misfit {
  bool surely = false, maybe = false;
  void add(const Interval& value, double low, double high) {
    const double slack = kSlack * (high - low), rounding = kRoundingOfSlack * (high - low);
    surely = surely || value.high < low - slack - rounding || value.low > high + slack + rounding;
    maybe = maybe || value.low < low - slack + rounding || value.high > high + slack - rounding;
  }
};

/// `values`: of MapTruth::channels(). Which colours a palette reaches isn't known here.
Misfit misfit_of(const MaterialMap& map, std::span<const Interval> all_values) {
  Misfit misfit;
  const std::span<const Interval> values = all_values.first(all_values.size() - map.overrides.size());
  const std::span<const Interval> compared = all_values.last(map.overrides.size());
  bool maybe_overridden = false;
  for (std::size_t i = 0; i < compared.size(); ++i) {
    if (map.overrides[i].instead_of != 0) continue;
    const double rounding = kRoundingOfSlack * std::abs(map.overrides[i].below);
    if (compared[i].high < map.overrides[i].below - rounding) return {};
    maybe_overridden = maybe_overridden || compared[i].low < map.overrides[i].below + rounding;
  }
  if (const auto* blend = std::get_if<BlendMap>(&map.kind)) {
    misfit.add(values[0], blend->stops.front().value, blend->stops.back().value);
  } else if (const auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    misfit.add(values[0], curve->points.front().property, curve->points.back().property);
  } else if (const auto* colour = std::get_if<ColourMap>(&map.kind)) {
    for (const Interval& value : values) misfit.add(value, 0, colour->full_value);
    misfit.maybe = true;
  } else if (const auto* direct = std::get_if<DirectMap>(&map.kind)) {
    Interval sum;
    for (const Interval& value : values) {
      misfit.add(value, 0, 1);
      sum = {sum.low + value.low, sum.high + value.high};
    }
    if (direct->rest_material != 0) sum.high = std::max(sum.high, 1.0);
    if (direct->rest_material != 0) sum.low = std::max(sum.low, 1.0);
    sum = {sum.low - 1, sum.high - 1};
    misfit.surely = misfit.surely || sum.low > kSlack + kRoundingOfSlack || sum.high < -kSlack - kRoundingOfSlack;
    misfit.maybe = misfit.maybe || sum.high > kSlack - kRoundingOfSlack || sum.low < -kSlack + kRoundingOfSlack;
  }
  misfit.surely = misfit.surely && !maybe_overridden;
  return misfit;
}

class StrictComparison {
 public:
  StrictComparison(const HostileRun& run, HostileFinding& finding)
      : run_(run), printing_(*run.job.asked.printing), finding_(finding) {
    const auto colours = colour_table_of(printing_);
    for (const MaterialMap* map : maps_of(printing_)) maps_.emplace_back(printing_, *map, colours);
    for (std::uint32_t c = 0; c < run.solid->channel_count(); ++c) {
      tolerances_.push_back(tolerance_of(run.solid->summary(), run.job.job, c));
    }
  }

  void compare() {
    std::size_t delivered = 0;
    std::optional<std::string> refusal;
    LayerSlicer slicer(run_.solid, run_.job.asked);
    try {
      for (const Layer& known : run_.delivered) {
        take(slicer.slice(known.index, {}), known);
        ++delivered;
      }
    } catch (const Error& error) {
      if (error.code() != ErrorCode::kFractionsOutOfRange) throw;
      refusal = error.what();
    }
    const std::uint32_t at = run_.job.first_layer + static_cast<std::uint32_t>(delivered);
    for (const Layer& inverted : run_.inverted) {
      if (inverted.index <= at) compare(inverted, refusal && inverted.index == at ? &*refusal : nullptr);
    }
  }

 private:
  void take(const Layer& layer, const Layer& known) {
    ++finding_.compared;
    for (std::size_t i = 0; i < layer.planes.size(); ++i) {
      if (layer.planes[i].bytes != known.planes[i].bytes) fail(layer, "another plane " + std::to_string(i));
    }
  }

  void compare(const Layer& inverted, const std::string* refusal) {
    Misfit any;
    const std::size_t voxels = std::size_t{extent().columns} * extent().rows;
    for (std::size_t v = 0; v < voxels && !any.surely; ++v) {
      const VoxelIndex at{static_cast<std::uint32_t>(v % extent().columns),
                          static_cast<std::uint32_t>(v / extent().columns), &inverted};
      if (!bit_at(inverted.planes[0], extent().columns, at.column, at.row)) continue;
      const Misfit misfit = misfit_at(at, v);
      any = {any.surely || misfit.surely, any.maybe || misfit.maybe};
    }
    ++finding_.compared;
    if (refusal == nullptr && any.surely) fail(inverted, "isn't refused, and has values that give no fractions");
    if (refusal == nullptr) return;
    if (!any.maybe) fail(inverted, "is refused, and all its values give fractions: " + *refusal);
    if (refusal->find("in layer " + std::to_string(inverted.index) + " ") == std::string::npos)
      fail(inverted, *refusal);
  }

  Misfit misfit_at(const VoxelIndex& at, std::size_t voxel) const {
    const std::size_t map = map_of(run_.has_regions() ? at.layer->planes[run_.region_plane()].bytes[voxel] : 1);
    if (!maps_of(printing_)[map]->strict) return {};
    std::vector<Interval> values;
    for (const std::string& channel : maps_[map].channels()) {
      const std::uint32_t c = *ChannelTable(run_.solid->summary().channels).at(channel).of_solid;
      const double value = inverted_value(run_, at, c);
      values.push_back({value - tolerances_[c], value + tolerances_[c]});
    }
    return misfit_of(*maps_of(printing_)[map], values);
  }

  /// Says which of maps_of(printing) a cell region has, by the region's number.
  std::size_t map_of(std::size_t region) const {
    for (std::size_t i = 0; i < printing_.cell_region_maps.size(); ++i) {
      if (printing_.cell_region_maps[i].cell_region + 1u == region) return i + 1;
    }
    return 0;
  }

  void fail(const Layer& layer, const std::string& what) {
    const SolidSummary& summary = run_.solid->summary();
    if (summary.folding_cells + summary.undecided_cells > 0) {
      ++finding_.excused;
    } else if (finding_.failed++ == 0) {
      finding_.where = "layer " + std::to_string(layer.index) + ": " + what;
    }
  }

  const GridExtent& extent() const { return run_.job.job.grid.extent; }

  const HostileRun& run_;
  const Printing& printing_;
  HostileFinding& finding_;
  std::vector<MapTruth> maps_;
  std::vector<double> tolerances_;
};

}  // namespace

void draw_strict_maps(HostileRandom& random, const SolidSummary& solid, Printing& printing, std::string& text) {
  const auto draw = [&](MaterialMap& map) {
    if (!random.chance(kShareOfStrictMaps)) return;
    map.strict = true;
    const bool covers = random.chance(0.5);
    if (covers) cover_range(solid, map);
    text += covers ? ", a strict map that covers" : ", a strict map";
  };
  draw(printing.map);
  for (CellRegionMap& own : printing.cell_region_maps) draw(own.map);
}

SliceJob without_strict_maps(SliceJob job) {
  if (!job.printing) return job;
  job.printing->map.strict = false;
  for (CellRegionMap& own : job.printing->cell_region_maps) own.map.strict = false;
  return job;
}

void compare_strict(const HostileRun& run, HostileFinding& finding) {
  if (run.job.asked.printing && is_strict(*run.job.asked.printing)) StrictComparison(run, finding).compare();
}

}  // namespace ccslice::oracle
