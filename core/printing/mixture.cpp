// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/mixture.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <utility>

namespace ccslice {
namespace {

constexpr std::size_t kShortTable = 9;  // Stops.

/// NaN becomes low.
float clamped(float value, float low, float high) noexcept { return std::min(std::max(low, value), high); }

/// Divides by the sum. The compiler vectorizes these loops over the block.
void normalize(std::size_t materials, std::size_t first, Fractions& fractions) noexcept {
  MixRow sum{};
  for (std::size_t m = 0; m < materials; ++m) {
    for (std::size_t k = 0; k < kMixBlock; ++k) sum[k] += fractions[m][k];
  }
  for (std::size_t k = 0; k < kMixBlock; ++k) {
    fractions[first][k] = sum[k] > 0 ? fractions[first][k] : 1;
    sum[k] = sum[k] > 0 ? 1 / sum[k] : 1;
  }
  for (std::size_t m = 0; m < materials; ++m) {
    for (std::size_t k = 0; k < kMixBlock; ++k) fractions[m][k] *= sum[k];
  }
}

/// What a map takes of a value, the slack included. No number is within.
struct Range {
  float least, most;
  Range(float low, float high)
      : least(low - static_cast<float>(kStrictSlack) * (high - low)),
        most(high + static_cast<float>(kStrictSlack) * (high - low)) {}
  int excludes(float value) const noexcept { return (value >= least) & (value <= most) ? 0 : 1; }
};

bool excludes_any(const Range& range, const MixRow& values) noexcept {
  int any = 0;
  for (std::size_t k = 0; k < kMixBlock; ++k) any |= range.excludes(values[k]);
  return any != 0;
}

bool exceeds_any(const MixRow& values, float most) noexcept {
  int any = 0;
  for (std::size_t k = 0; k < kMixBlock; ++k) any |= values[k] > most ? 1 : 0;
  return any != 0;
}

/// By voxel of a block, 1 for some.
using Marks = std::array<std::int32_t, kMixBlock>;

std::uint64_t marked(const Marks& marks, std::size_t begin, std::size_t end) noexcept {
  std::int32_t count = 0;
  for (std::size_t k = begin; k < end; ++k) count += marks[k];
  return static_cast<std::uint64_t>(count);
}

/// Voxels whose sum is below 1.
void count_scaled_up(const MixRow& sum, std::size_t begin, std::size_t end, MapMisfits& misfits) noexcept {
  constexpr auto kOne = 1 - static_cast<float>(kStrictSlack);
  // Floats from 0 on are in the order of their bits, whose least one the compiler finds in vectors.
  constexpr auto kOneBits = std::bit_cast<std::int32_t>(kOne);
  std::int32_t least = kOneBits, count = 0;
  for (std::size_t k = begin; k < end; ++k) {
    const auto bits = std::bit_cast<std::int32_t>(sum[k]);
    least = std::min(least, bits);
    count += bits < kOneBits ? 1 : 0;
  }
  if (count == 0) return;
  misfits.scaled_up += static_cast<std::uint64_t>(count);
  misfits.least_sum = std::min(misfits.least_sum, double{std::bit_cast<float>(least)});
}

}  // namespace

Mixture::Mixture(const Printing& printing, const MaterialMap& map, std::shared_ptr<const ColourTable> colours)
    : material_count_(printing.materials.size()), channels_(channels_of(map)) {
  if (const auto* colour = std::get_if<ColourMap>(&map.kind)) {
    make_table(*colour, std::move(colours));
  } else if (const auto* blend = std::get_if<BlendMap>(&map.kind)) {
    make_table(*blend);
  } else if (const auto* curve = std::get_if<CalibrationMap>(&map.kind)) {
    make_table(*curve);
  } else if (const auto* direct = std::get_if<DirectMap>(&map.kind)) {
    make_table(*direct);
  } else if (const auto* pure = std::get_if<PureMap>(&map.kind)) {
    first_ = pure->material - 1;
  }
  for (const MapOverride& first : map.overrides) {
    const auto row = static_cast<std::size_t>(std::ranges::find(channels_, first.channel) - channels_.begin());
    const Override own{row, static_cast<float>(first.below), first.material - 1};
    if (first.instead_of == 0) {
      overrides_.push_back(own);
    } else {
      replacements_.push_back({own, first.instead_of - 1});
    }
  }
}

void Mixture::make_table(const BlendMap& map) {
  for (const BlendMap::Stop& stop : map.stops) {
    table_.values.push_back(static_cast<float>(stop.value));
    table_.fractions.emplace_back().fill(0);
    table_.fractions.back()[stop.material - 1] = 1;
  }
  finish_table();
}

void Mixture::make_table(const CalibrationMap& map) {
  for (const CalibrationMap::Point& point : map.points) {
    table_.values.push_back(static_cast<float>(point.property));
    table_.fractions.emplace_back().fill(0);
    table_.fractions.back()[map.material - 1] = static_cast<float>(point.fraction);
    table_.fractions.back()[map.base - 1] = static_cast<float>(1 - point.fraction);
  }
  finish_table();
}

void Mixture::finish_table() {
  kind_ = Kind::kTable;
  for (std::size_t s = 0; s + 1 < table_.values.size(); ++s) {
    const float length = table_.values[s + 1] - table_.values[s];
    table_.inverse_lengths.push_back(std::min(1 / length, std::numeric_limits<float>::max()));
  }
}

void Mixture::make_table(const DirectMap& map) {
  kind_ = Kind::kShares;
  for (const DirectMap::Share& share : map.shares) {
    const auto row = std::find(channels_.begin(), channels_.end(), share.channel) - channels_.begin();
    shares_.push_back({static_cast<std::size_t>(row), share.material - 1});
  }
  first_ = shares_.front().material;
  if (map.rest_material != 0) rest_ = map.rest_material - 1;
}

void Mixture::make_table(const ColourMap& map, std::shared_ptr<const ColourTable> colours) {
  kind_ = Kind::kColours;
  const auto row = [&](const std::string& channel) {
    return static_cast<std::size_t>(std::find(channels_.begin(), channels_.end(), channel) - channels_.begin());
  };
  colours_.rows = {row(map.red), row(map.green), row(map.blue)};
  colours_.scale = static_cast<float>((ColourTable::kNodes - 1) / map.full_value);
  colours_.table = std::move(colours);
}

void Mixture::evaluate(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  mix_kind(values, fractions);
  if (!overrides_.empty()) override_kind(values, fractions);
  if (!replacements_.empty()) replace(values, fractions);
}

/// Applies the last one first, so that those before it have the last word.
void Mixture::override_kind(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  for (std::size_t i = overrides_.size(); i > 0; --i) {
    const Override& own = overrides_[i - 1];
    const MixRow& row = values[own.row];
    for (std::size_t m = 0; m < material_count_; ++m) {
      const float fraction = m == own.material ? 1.0f : 0.0f;
      for (std::size_t k = 0; k < kMixBlock; ++k) fractions[m][k] = row[k] < own.below ? fraction : fractions[m][k];
    }
  }
}

/// Moves fractions. No replacement gives a material that another one takes away, so their order doesn't matter.
void Mixture::replace(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  for (const Replacement& own : replacements_) {
    const MixRow& row = values[own.row];
    MixRow &from = fractions[own.instead_of], &to = fractions[own.material];
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      const float moved = row[k] < own.below ? from[k] : 0.0f;
      from[k] -= moved;
      to[k] += moved;
    }
  }
}

bool Mixture::is_overridden(std::span<const MixRow> values, std::size_t voxel) const noexcept {
  return std::ranges::any_of(overrides_, [&](const Override& own) { return values[own.row][voxel] < own.below; });
}

void Mixture::mix_kind(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  switch (kind_) {
    case Kind::kPure:
      for (std::size_t m = 0; m < material_count_; ++m) fractions[m].fill(m == first_ ? 1 : 0);
      return;
    case Kind::kShares: return mix_shares(values, fractions);
    case Kind::kColours: return mix_colours(values, fractions);
    case Kind::kTable:
      if (table_.values.size() <= kShortTable) return mix_short_table(values.front(), fractions);
      return mix_long_table(values.front(), fractions);
  }
}

void Mixture::mix_short_table(const MixRow& values, Fractions& fractions) const noexcept {
  for (std::size_t m = 0; m < material_count_; ++m) fractions[m].fill(table_.fractions.front()[m]);
  for (std::size_t s = 0; s + 1 < table_.values.size(); ++s) {
    MixRow along;
    const float start = table_.values[s], inverse = table_.inverse_lengths[s];
    for (std::size_t k = 0; k < kMixBlock; ++k) along[k] = clamped((values[k] - start) * inverse, 0, 1);
    for (std::size_t m = 0; m < material_count_; ++m) {
      const float step = table_.fractions[s + 1][m] - table_.fractions[s][m];
      if (step == 0) continue;
      for (std::size_t k = 0; k < kMixBlock; ++k) fractions[m][k] = std::max(0.0f, fractions[m][k] + step * along[k]);
    }
  }
}

void Mixture::mix_long_table(const MixRow& values, Fractions& fractions) const noexcept {
  const std::size_t last = table_.values.size() - 2;  // Segment.
  std::size_t s = 0;
  for (std::size_t k = 0; k < kMixBlock; ++k) {
    while (s < last && values[k] >= table_.values[s + 1]) ++s;
    while (s > 0 && values[k] < table_.values[s]) --s;
    const float along = clamped((values[k] - table_.values[s]) * table_.inverse_lengths[s], 0, 1);
    const auto &low = table_.fractions[s], &high = table_.fractions[s + 1];
    for (std::size_t m = 0; m < material_count_; ++m) fractions[m][k] = low[m] + (high[m] - low[m]) * along;
  }
}

void Mixture::mix_shares(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  for (std::size_t m = 0; m < material_count_; ++m) fractions[m].fill(0);
  for (const Share& share : shares_) {
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      fractions[share.material][k] = clamped(values[share.row][k], 0, std::numeric_limits<float>::max() / 16);
    }
  }
  if (rest_) {
    MixRow rest;
    rest.fill(1);
    for (const Share& share : shares_) {
      for (std::size_t k = 0; k < kMixBlock; ++k) rest[k] -= fractions[share.material][k];
    }
    for (std::size_t k = 0; k < kMixBlock; ++k) fractions[*rest_][k] = std::max(0.0f, rest[k]);
  }
  normalize(material_count_, first_, fractions);
}

void Mixture::mix_colours(std::span<const MixRow> values, Fractions& fractions) const noexcept {
  for (std::size_t k = 0; k < kMixBlock; ++k) {
    std::array<float, 3> at;
    for (std::size_t axis = 0; axis < at.size(); ++axis) {
      at[axis] = clamped(values[colours_.rows[axis]][k] * colours_.scale, 0, ColourTable::kNodes - 1);
    }
    const ColourTable::Weights weights = colours_.table->weights(at);
    for (std::size_t m = 0; m < material_count_; ++m) fractions[m][k] = weights[m];
  }
}

std::optional<std::size_t> Mixture::first_misfit(std::span<const MixRow> values, std::size_t begin,
                                                 std::size_t end) const noexcept {
  for (std::size_t k = begin; k < end; ++k) {
    if (is_overridden(values, k)) continue;
    if (kind_ == Kind::kTable && !table_fits(values.front()[k])) return k;
    if (kind_ == Kind::kShares && !shares_fit(values, k)) return k;
    if (kind_ == Kind::kColours && !colour_fits(values, k)) return k;
  }
  return std::nullopt;
}

void Mixture::count_misfits(std::span<const MixRow> values, std::size_t begin, std::size_t end,
                            MapMisfits& misfits) const noexcept {
  Marks off;  // Set once some voxel is off, as few are.
  bool any = false;
  const auto mark_off = [&](const auto& is_off) {
    if (!any) off.fill(0);
    any = true;
    for (std::size_t k = 0; k < kMixBlock; ++k) off[k] |= is_off(k);
  };
  const auto look_at = [&](std::size_t row, const Range& range) {
    if (excludes_any(range, values[row])) mark_off([&](std::size_t k) { return range.excludes(values[row][k]); });
  };
  if (kind_ == Kind::kTable) look_at(0, {table_.values.front(), table_.values.back()});
  if (kind_ == Kind::kColours) {
    for (const std::size_t row : colours_.rows) look_at(row, {0, (ColourTable::kNodes - 1) / colours_.scale});
  }
  if (kind_ == Kind::kShares) {
    for (const Share& share : shares_) look_at(share.row, {0, 1});
    MixRow sum = sum_of_shares(values);
    if (!overrides_.empty()) {
      for (std::size_t k = begin; k < end; ++k) sum[k] = is_overridden(values, k) ? 1 : sum[k];
    }
    const Range one{0, 1};
    if (exceeds_any(sum, one.most)) mark_off([&](std::size_t k) { return sum[k] > one.most ? 1 : 0; });
    if (!rest_) count_scaled_up(sum, begin, end, misfits);
  }
  if (!any) return;
  if (!overrides_.empty()) {
    for (std::size_t k = begin; k < end; ++k) off[k] = is_overridden(values, k) ? 0 : off[k];
  }
  misfits.off_map += marked(off, begin, end);
}

/// Of what is above 0.
MixRow Mixture::sum_of_shares(std::span<const MixRow> values) const noexcept {
  MixRow sum;
  for (std::size_t i = 0; i < shares_.size(); ++i) {
    const MixRow& row = values[shares_[i].row];
    for (std::size_t k = 0; k < kMixBlock; ++k) sum[k] = (i == 0 ? 0 : sum[k]) + std::max(0.0f, row[k]);
  }
  return sum;
}

bool Mixture::table_fits(float value) const noexcept {
  const double low = table_.values.front(), high = table_.values.back(), slack = kStrictSlack * (high - low);
  return value >= low - slack && value <= high + slack;
}

bool Mixture::shares_fit(std::span<const MixRow> values, std::size_t voxel) const noexcept {
  double sum = 0;
  for (const Share& share : shares_) {
    const double value = values[share.row][voxel];
    if (!(value >= -kStrictSlack && value <= 1 + kStrictSlack)) return false;
    sum += value;
  }
  return sum <= 1 + kStrictSlack && (rest_ || sum >= 1 - kStrictSlack);
}

bool Mixture::colour_fits(std::span<const MixRow> values, std::size_t voxel) const noexcept {
  constexpr double kLast = ColourTable::kNodes - 1;
  std::array<double, 3> node;
  for (std::size_t axis = 0; axis < node.size(); ++axis) {
    const double at = values[colours_.rows[axis]][voxel] * colours_.scale / kLast;
    if (!(at >= -kStrictSlack && at <= 1 + kStrictSlack)) return false;
    node[axis] = std::clamp(at, 0.0, 1.0) * kLast;
  }
  return colours_.table->is_reached(node);
}

std::vector<std::size_t> places_among(std::span<const std::string> channels, const Mixture& mixture) {
  std::vector<std::size_t> places;
  for (const std::string& channel : mixture.channels()) {
    places.push_back(static_cast<std::size_t>(std::ranges::find(channels, channel) - channels.begin()));
  }
  return places;
}

}  // namespace ccslice
