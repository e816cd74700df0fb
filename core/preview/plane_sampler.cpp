// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/plane_sampler.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <utility>

#include "core/field/material_pass.h"
#include "core/limit/cell_index.h"
#include "core/raster/layer_window.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kBlock = 8, kQuarter = 4, kSmallest = 2;
// Shares of the tolerance.
constexpr double kMisfit = 0.1, kMisfitOfCorners = 0.5, kMisfitOfCheck = 0.15;
constexpr double kSteepest = 1;          // Tolerances from a sample to any pixel, where few samples leave a bend open.
constexpr double kFarFromSamples = 1.5;  // Pixels.
constexpr double kThinnestCell = 0.3;    // Of a block's side.
constexpr double kNarrowest = 1e-3;      // Of a channel's range: what reaches over less is as good as constant.
constexpr int kFewestPixels = 4;
constexpr int kPixelsPerSample = 2;  // It doesn't pay to invert more of them, but for corners, which blocks share.

constexpr std::uint64_t kColumns0To6 = 0x7f7f7f7f7f7f7f7f, kColumns1To7 = 0xfefefefefefefefe;

/// The pixels that hang together with the first one, side by side.
std::uint64_t first_part(std::uint64_t pixels) {
  std::uint64_t part = pixels & (~pixels + 1);
  for (;;) {
    const std::uint64_t grown =
        (part | ((part & kColumns0To6) << 1) | ((part & kColumns1To7) >> 1) | (part << kBlock) | (part >> kBlock)) &
        pixels;
    if (grown == part) return part;
    part = grown;
  }
}

/// Calls visit(column, row) for each pixel.
template <typename Visit>
void for_each_pixel(std::uint64_t pixels, const Visit& visit) {
  for (; pixels != 0; pixels &= pixels - 1) {
    const auto bit = static_cast<std::uint32_t>(std::countr_zero(pixels));
    visit(bit % kBlock, bit / kBlock);
  }
}

std::uint32_t distance(std::uint32_t a, std::uint32_t b) { return a < b ? b - a : a - b; }

}  // namespace

PlaneSampler::PlaneSampler(std::shared_ptr<const LimitSolid> solid) : solid_(std::move(solid)), inverter_(solid_) {}

void PlaneSampler::Places::add(std::uint32_t column, std::uint32_t row) {
  const std::array place{column, row};
  const auto end = at.begin() + static_cast<std::ptrdiff_t>(count);
  if (std::find(at.begin(), end, place) == end) at[count++] = place;
}

void PlaneSampler::paint(const LayerTarget& target, const InterpolationSpec& spec, MaterialField& field,
                         std::span<const VoxelRun> spans, std::span<const RegionRun> regions,
                         const SamplingOptions& options) {
  target_ = &target;
  channels_ = spec.channels;
  columns_ = target.lattice.width;
  rows_ = target.lattice.height;
  number_pixels(spans, regions);
  left_.assign(numbers_.size(), Left::kNothing);
  inverter_.start(target, spec, field, {.strict = !regions.empty(), .rough = options.rough});
  if (options.own_range) narrow_tolerances();
  for (std::uint32_t row = 0; row < rows_; row += kBlock) {
    target.cancel.throw_if_cancelled();
    for (std::uint32_t column = 0; column < columns_; column += kBlock) paint_block(column, row);
  }
  solve_rest(spans, field);
}

void PlaneSampler::number_pixels(std::span<const VoxelRun> spans, std::span<const RegionRun> regions) {
  numbers_.assign(std::size_t{columns_} * rows_, 0);
  const auto number = [&](const VoxelRun& run, std::uint8_t value) {
    std::fill_n(numbers_.begin() + static_cast<std::ptrdiff_t>(std::size_t{columns_} * run.row + run.begin),
                run.end - run.begin, value);
  };
  for (const VoxelRun& span : spans) number(span, 1);
  for (const RegionRun& run : regions) number(run, static_cast<std::uint8_t>(run.region + 1));
}

std::uint8_t PlaneSampler::number_at(std::uint32_t column, std::uint32_t row) const {
  return column < columns_ && row < rows_ ? numbers_[std::size_t{columns_} * row + column] : std::uint8_t{0};
}

/// By what the values at the blocks' corners reach over, which isn't more than the picture's. They are needed anyway.
void PlaneSampler::narrow_tolerances() {
  std::vector<ValueRange> reached(channels_.size(),
                                  {std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()});
  const CellIndex& index = solid_->index();
  const bool may_be_ambiguous = index.fold_boxes.size() + index.overlap_boxes.size() > 0;
  for (std::uint32_t row = 0; row < rows_; row += kBlock) {
    target_->cancel.throw_if_cancelled();
    for (std::uint32_t column = 0; column < columns_; column += kBlock) {
      if (number_at(column, row) == 0) continue;
      if (may_be_ambiguous && surroundings_of(column, row, kBlock) == Surroundings::kAmbiguous) continue;
      const std::uint32_t number = inverter_.invert(column, row);
      if (!inverter_.pixel(number).smooth) continue;
      for (std::size_t c = 0; c < channels_.size(); ++c) {
        const double value = inverter_.sample(number, c).value;
        reached[c] = {std::min(reached[c].min, value), std::max(reached[c].max, value)};
      }
    }
  }
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const ChannelRange& channel = solid_->summary().channels[channels_[c].channel];
    const double share = (reached[c].max - reached[c].min) / (channel.max - channel.min);
    // Where no corner is inside the share is below 0, and the narrowest tolerance is on the safe side.
    if (share < 1) channels_[c].tolerance *= std::max(share, kNarrowest);  // Not for NaN.
  }
}

PlaneSampler::Surroundings PlaneSampler::surroundings_of(std::uint32_t column, std::uint32_t row,
                                                         std::uint32_t side) const {
  Box3 box;
  for (unsigned corner = 0; corner < 4; ++corner) {
    box.extend(inverter_.place_of(column + (corner & 1) * side, row + (corner >> 1) * side));
  }
  box.min().array() -= inverter_.outside_mm();
  box.max().array() += inverter_.outside_mm();
  const CellIndex& index = solid_->index();
  if (index.is_ambiguous(box)) return Surroundings::kAmbiguous;
  const double thinnest_mm = kThinnestCell * side * inverter_.pixel_mm();
  const bool thin = index.cell_boxes.any_meeting(
      box, [&](std::uint32_t cell) { return index.cell_maps[LimitCellId{cell}].thickness_mm() < thinnest_mm; });
  return thin ? Surroundings::kThin : Surroundings::kSmooth;
}

void PlaneSampler::paint_block(std::uint32_t column, std::uint32_t row) {
  std::array<std::uint8_t, kBlock * kBlock> numbers{};
  Mask left = 0;
  for (std::uint32_t y = 0; y < kBlock; ++y) {
    for (std::uint32_t x = 0; x < kBlock; ++x) {
      numbers[kBlock * y + x] = number_at(column + x, row + y);
      if (numbers[kBlock * y + x] != 0) left |= Mask{1} << (kBlock * y + x);
    }
  }
  if (left == 0) return;
  const bool smooth = surroundings_of(column, row, kBlock) == Surroundings::kSmooth;
  while (left != 0) {
    const std::uint8_t number = numbers[static_cast<std::size_t>(std::countr_zero(left))];
    Mask same = 0;
    for_each_pixel(left, [&](std::uint32_t x, std::uint32_t y) {
      if (numbers[kBlock * y + x] == number) same |= Mask{1} << (kBlock * y + x);
    });
    const Part part{column, row, kBlock, first_part(same), number};
    left &= ~part.pixels;
    if (!smooth || !paint_part(part)) paint_quarters(part);
  }
}

/// Down to blocks of 2 x 2.
void PlaneSampler::paint_quarters(const Part& part) {
  const std::uint32_t side = part.side / 2;
  Mask first_quarter = 0;
  for (std::uint32_t y = 0; y < side; ++y) first_quarter |= ((Mask{1} << side) - 1) << (kBlock * y);
  for (std::uint32_t quarter = 0; quarter < 4; ++quarter) {
    const std::uint32_t x = side * (quarter & 1), y = side * (quarter >> 1);
    Mask left = part.pixels >> (kBlock * y + x) & first_quarter;
    if (left == 0) continue;
    const Surroundings around = surroundings_of(part.column + x, part.row + y, side);
    while (left != 0) {
      const Part own{part.column + x, part.row + y, side, first_part(left), part.number};
      left &= ~own.pixels;
      if (around == Surroundings::kSmooth && paint_part(own)) continue;
      if (around != Surroundings::kAmbiguous && side > kSmallest) {
        paint_quarters(own);
      } else {
        leave(own, around == Surroundings::kAmbiguous ? Left::kToPass : Left::kToInverter);
      }
    }
  }
}

/// The pixel after a block's last one is its neighbour's first; it serves as the corner of both if it hangs together
/// with the part.
bool PlaneSampler::has_corner(const Part& part, unsigned corner) const {
  const std::uint32_t last = part.side - 1;
  const bool right = corner & 1, upper = corner >> 1;
  const std::uint32_t x = right ? last : 0, y = upper ? last : 0;
  if (!(part.pixels >> (kBlock * y + x) & 1)) return false;
  const auto is_like = [&](bool next_column, bool next_row) {
    return number_at(part.column + x + next_column, part.row + y + next_row) == part.number;
  };
  return (!right || is_like(true, false)) && (!upper || is_like(false, true)) &&
         (!(right && upper) || is_like(true, true));
}

/// The block's corners, or the part's pixels nearest to them.
PlaneSampler::Places PlaneSampler::places_of(const Part& part) const {
  Places places;
  for (unsigned corner = 0; corner < 4; ++corner) {
    const std::uint32_t x = corner & 1 ? part.side : 0, y = corner >> 1 ? part.side : 0;
    if (has_corner(part, corner)) {
      places.add(x, y);
    } else {
      places.corners = false;
      const auto [column, row] = nearest_pixel(part, x, y);
      places.add(column, row);
    }
  }
  return places;
}

/// Pixels that are inverted already are worth a little way.
std::array<std::uint32_t, 2> PlaneSampler::nearest_pixel(const Part& part, std::uint32_t column,
                                                         std::uint32_t row) const {
  constexpr std::uint32_t kPerPixel = 3, kIfUnknown = 4;
  std::array<std::uint32_t, 2> nearest{};
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  for_each_pixel(part.pixels, [&](std::uint32_t x, std::uint32_t y) {
    const std::uint32_t far = kPerPixel * (distance(x, column) + distance(y, row)) +
                              (inverter_.find(part.column + x, part.row + y) ? 0 : kIfUnknown);
    if (far >= least) return;
    least = far;
    nearest = {x, y};
  });
  return nearest;
}

/// Paints a part by a polynomial, if one is near enough.
bool PlaneSampler::paint_part(const Part& part) {
  const int count = std::popcount(part.pixels);
  if (count < kFewestPixels) return false;
  Places places = places_of(part);
  int unknown = 0;
  for (std::size_t i = 0; i < places.count; ++i) {
    unknown += inverter_.find(part.column + places.at[i][0], part.row + places.at[i][1]) ? 0 : 1;
  }
  if (!places.corners && (solid_->as_meshed() || kPixelsPerSample * unknown > count)) return false;
  if (places.count < 2) return false;
  if (places.corners) {
    const bool checked = part.side == kBlock;
    return paint_by(
        part, places,
        checked ? std::optional(inverter_.invert(part.column + kQuarter, part.row + kQuarter)) : std::nullopt);
  }
  std::uint32_t farthest = 0;
  std::array<std::uint32_t, 2> far{};
  for_each_pixel(part.pixels, [&](std::uint32_t x, std::uint32_t y) {
    std::uint32_t nearest = std::numeric_limits<std::uint32_t>::max();
    for (std::size_t i = 0; i < places.count; ++i) {
      const std::uint32_t across = distance(x, places.at[i][0]), up = distance(y, places.at[i][1]);
      nearest = std::min(nearest, across * across + up * up);
    }
    if (nearest <= farthest) return;
    farthest = nearest;
    far = {x, y};
  });
  const double reach = std::sqrt(farthest);
  if (!is_flat(part, places, reach)) return false;
  return paint_by(part, places,
                  reach < kFarFromSamples ? std::nullopt
                                          : std::optional(inverter_.invert(part.column + far[0], part.row + far[1])));
}

SurfaceSample PlaneSampler::sample_of(const Part& part, std::uint32_t number, std::size_t channel) const {
  const SurfaceSample& sample = inverter_.sample(number, channel);
  return {sample.value, 0.5 * part.side * sample.slope};
}

/// Four samples say enough about any bend.
bool PlaneSampler::is_flat(const Part& part, const Places& places, double reach) const {
  if (places.count >= 4) return true;
  for (std::size_t i = 0; i < places.count; ++i) {
    const auto number = inverter_.find(part.column + places.at[i][0], part.row + places.at[i][1]);
    if (!number) continue;
    for (std::size_t c = 0; c < channels_.size(); ++c) {
      const double change = reach * inverter_.sample(*number, c).slope.norm();
      if (!(change <= kSteepest * channels_[c].tolerance)) return false;
    }
  }
  return true;
}

/// `check`: the number of one more pixel of the part.
bool PlaneSampler::paint_by(const Part& part, const Places& places, std::optional<std::uint32_t> check) {
  const double half = 0.5 * part.side;
  std::array<std::uint32_t, QuadraticFitter::kMostPlaces + 1> numbers;
  std::array<Vec2, QuadraticFitter::kMostPlaces> at;
  for (std::size_t i = 0; i < places.count; ++i) {
    numbers[i] = inverter_.invert(part.column + places.at[i][0], part.row + places.at[i][1]);
    if (!inverter_.pixel(numbers[i]).smooth) return false;
    at[i] = Vec2(places.at[i][0], places.at[i][1]) / half - Vec2::Ones();
  }
  if (check && !inverter_.pixel(*check).smooth) return false;
  if (check) numbers[places.count] = *check;
  const auto inverted = std::span(numbers).first(places.count + (check ? 1 : 0));
  if (solid_->as_meshed() && !inverter_.are_amid_a_cell(inverted)) return false;
  std::optional<QuadraticFitter> own;
  if (!places.corners) own.emplace(std::span(at).first(places.count));
  const QuadraticFitter& fitter = own ? *own : QuadraticFitter::of_corners();
  std::vector<PixelSurface> surfaces;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    std::array<SurfaceSample, QuadraticFitter::kMostPlaces> samples;
    for (std::size_t i = 0; i < places.count; ++i) samples[i] = sample_of(part, numbers[i], c);
    const auto given = std::span(samples).first(places.count);
    PixelSurface surface = fitter.fit(given);
    const double misfit = fitter.misfit(surface, given) / channels_[c].tolerance;
    if (!(misfit <= (places.corners ? kMisfitOfCorners : kMisfit))) return false;
    if (places.corners) surface = surface_of_corners({samples[0], samples[1], samples[2], samples[3]});
    if (check) {
      const PixelInverter::Pixel& pixel = inverter_.pixel(*check);
      const Vec2 place = Vec2(pixel.column - part.column, pixel.row - part.row) / half - Vec2::Ones();
      const double off = std::abs(surface.at(place).value - inverter_.sample(*check, c).value);
      if (!(off <= kMisfitOfCheck * channels_[c].tolerance)) return false;
    }
    surfaces.push_back(surface);
  }
  for (std::size_t c = 0; c < channels_.size(); ++c) fill(part, surfaces[c], channels_[c].channel);
  return true;
}

void PlaneSampler::fill(const Part& part, const PixelSurface& surface, std::uint32_t channel) {
  const double step = 2.0 / part.side;
  for (std::uint32_t y = 0; y < part.side; ++y) {
    std::uint32_t left = part.pixels >> (kBlock * y) & 0xff;
    if (left == 0) continue;
    const std::array<double, 4> cubic = surface.row(step * y - 1);
    while (left != 0) {
      const auto first = static_cast<std::uint32_t>(std::countr_zero(left));
      const auto count = static_cast<std::uint32_t>(std::countr_one(left >> first));
      const std::size_t index = target_->window.index(part.column + first, part.row + y);
      for (ContonePlane& plane : target_->planes) {
        if (plane.channel() == channel) plane.set_cubic(index, first, count, -1, step, cubic);
      }
      left &= ~(((1u << count) - 1) << first);
    }
  }
}

void PlaneSampler::leave(const Part& part, Left how) {
  for_each_pixel(part.pixels, [&](std::uint32_t x, std::uint32_t y) {
    left_[std::size_t{columns_} * (part.row + y) + part.column + x] = how;
  });
}

void PlaneSampler::solve_rest(std::span<const VoxelRun> spans, MaterialField& field) {
  MaterialPass pass(field);
  pass.start_layer();
  const std::size_t sampled = inverter_.count();
  for (const VoxelRun& span : spans) {
    target_->cancel.throw_if_cancelled();
    inverter_.forget_after(sampled);  // Else all pixels might be kept.
    const Left* left = &left_[std::size_t{columns_} * span.row];
    for (std::uint32_t x = span.begin; x < span.end; ++x) {
      if (left[x] == Left::kNothing || (left[x] == Left::kToInverter && set_pixel(x, span.row))) continue;
      const std::uint32_t begin = x;
      while (x + 1 < span.end && left[x + 1] == Left::kToPass) ++x;
      pass.solve_from(*target_, {{span.row, begin, x + 1}, hint_at(begin, span.row)});
    }
  }
  // A whole layer has whatever its unresolved pixels take theirs from.
  static_cast<void>(pass.finish_layer(*target_, spans));
}

/// False if the inverter can't tell.
bool PlaneSampler::set_pixel(std::uint32_t column, std::uint32_t row) {
  const std::uint32_t number = inverter_.invert(column, row, PixelInverter::Wanted::kValues);
  if (!inverter_.pixel(number).smooth) return false;
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    for (ContonePlane& plane : target_->planes) {
      if (plane.channel() != channels_[c].channel) continue;
      plane.set_cubic(target_->window.index(column, row), 0, 1, 0, 0, {inverter_.sample(number, c).value, 0, 0, 0});
    }
  }
  return true;
}

/// A guess from the nearest smooth pixel of the block of 4 x 4, its neighbours' first ones included.
std::optional<CellParam> PlaneSampler::hint_at(std::uint32_t column, std::uint32_t row) const {
  const std::uint32_t first_column = column / kQuarter * kQuarter, first_row = row / kQuarter * kQuarter;
  std::optional<std::uint32_t> nearest;
  std::uint32_t least = std::numeric_limits<std::uint32_t>::max();
  for (std::uint32_t y = first_row; y < std::min(rows_, first_row + kQuarter + 1); ++y) {
    for (std::uint32_t x = first_column; x < std::min(columns_, first_column + kQuarter + 1); ++x) {
      const std::optional<std::uint32_t> number = inverter_.find(x, y);
      const std::uint32_t far = distance(x, column) + distance(y, row);
      if (!number || !inverter_.pixel(*number).smooth || far >= least) continue;
      least = far;
      nearest = number;
    }
  }
  if (!nearest) return std::nullopt;
  return inverter_.guess(*nearest, column, row);
}

}  // namespace ccslice
