// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/printing/halftone.h"

#include <algorithm>
#include <cstring>

#include "core/printing/voxel_hash.h"

namespace ccslice {
namespace {

static_assert(kMixBlock == kMaskEdge, "a block of a row has the thresholds of a row of the mask");

// Mixed, so that seeds of neighbouring numbers have nothing to do with each other.
std::uint32_t shift(std::uint64_t seed, std::uint64_t axis) {
  return seed == 0 ? 0 : static_cast<std::uint32_t>(mix64(mix64(seed) + axis) % kMaskEdge);
}

// Steps of error diffusion's sequence from row to row and from layer to layer (error_diffusion.cpp).
std::uint32_t even_phase(std::uint64_t seed, std::uint32_t y, std::uint32_t z) {
  return static_cast<std::uint32_t>(mix64(seed)) + 0xabc98389u * y + 0x8cb92ba7u * z;
}

// Thresholds of white noise have as many bits as the mask's: none is so near to 1 that the sum's rounding matters.
float white_threshold(std::uint32_t key, std::uint32_t x) {
  return (static_cast<float>(static_cast<std::int32_t>(random_bits(key, x) >> 14)) + 0.5f) * 0x1p-18f;
}

/// All are narrowed, which the compiler vectorizes, and some are copied.
void copy_numbers(const std::array<std::int32_t, kMixBlock>& chosen, std::uint32_t begin, std::uint32_t end,
                  std::uint8_t* out) noexcept {
  std::array<std::uint8_t, kMixBlock> numbers;
  for (std::size_t k = 0; k < kMixBlock; ++k) numbers[k] = static_cast<std::uint8_t>(chosen[k]);
  std::memcpy(out + begin, numbers.data() + begin, end - begin);
}

}  // namespace

std::optional<VoxelShape> mask_shape(const Printing& printing, double pitch_x_mm, double pitch_y_mm,
                                     double pitch_z_mm) {
  if (!printing.halftone.traits().has_mask || printing.materials.size() == 1) return std::nullopt;
  return voxel_shape(pitch_x_mm, pitch_y_mm, pitch_z_mm);
}

HalftonePlan::HalftonePlan(const Printing& printing, double pitch_x_mm, double pitch_y_mm, double pitch_z_mm,
                           const CancellationToken& cancel)
    : printing_(printing) {
  const std::shared_ptr<const ColourTable> colours = colour_table_of(printing, cancel);
  for (const MaterialMap* map : maps_of(printing)) mixtures_.emplace_back(printing, *map, colours);
  std::uint16_t mixture = 0;
  for (const CellRegionMap& own : printing.cell_region_maps) mixture_of_region_[own.cell_region] = ++mixture;
  if (const auto shape = mask_shape(printing, pitch_x_mm, pitch_y_mm, pitch_z_mm)) mask_ = shared_mask(*shape, cancel);
}

void Halftoner::start_layer(std::uint32_t width, std::uint32_t layer) {
  layer_ = layer;
  row_ = 0;
  if (plan_.printing().halftone.traits().carries_errors) diffusion_.start_layer(width);
}

void Halftoner::start_row(std::uint32_t y) {
  const Halftone& halftone = plan_.printing().halftone;
  key_ = row_key(halftone.seed, y, layer_);
  reverse_ = false;
  if (plan_.mask() != nullptr) {
    const auto row = plan_.mask()->row(y + shift(halftone.seed, 1), layer_ + shift(halftone.seed, 2));
    std::rotate_copy(row.begin(), row.begin() + shift(halftone.seed, 0), row.end(), thresholds_.begin());
  }
  if (!halftone.traits().carries_errors) return;
  reverse_ = ((y ^ layer_) & 1) != 0;
  diffusion_.start_row(
      y - row_, reverse_,
      {key_, even_phase(halftone.seed, y, layer_), ErrorDiffusion::minor_phase(halftone.seed, y, layer_)});
  row_ = y;
}

void Halftoner::choose(std::uint32_t block, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                       std::uint8_t* out) noexcept {
  const std::uint32_t first = block * static_cast<std::uint32_t>(kMixBlock);
  if (plan_.material_count() == 1) {
    std::fill(out + begin, out + end, std::uint8_t{1});
    return;
  }
  switch (plan_.printing().halftone.method) {
    case HalftoneMethod::kBlueNoise: return choose_by_thresholds(thresholds_, begin, end, fractions, out);
    case HalftoneMethod::kErrorDiffusion: return diffusion_.choose(first, begin, end, fractions, out);
    case HalftoneMethod::kLargestFraction: return choose_largest(begin, end, fractions, out);
    case HalftoneMethod::kWhiteNoise: break;
  }
  MixRow thresholds;
  for (std::uint32_t k = 0; k < kMixBlock; ++k) thresholds[k] = white_threshold(key_, first + k);
  choose_by_thresholds(thresholds, begin, end, fractions, out);
}

void Halftoner::choose_by_thresholds(const MixRow& thresholds, std::uint32_t begin, std::uint32_t end,
                                     const Fractions& fractions, std::uint8_t* out) const noexcept {
  std::array<std::int32_t, kMixBlock> chosen;
  chosen.fill(1);
  MixRow sum{};
  for (std::size_t m = 0; m + 1 < plan_.material_count(); ++m) {
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      sum[k] += fractions[m][k];
      chosen[k] += thresholds[k] >= sum[k] ? 1 : 0;
    }
  }
  copy_numbers(chosen, begin, end, out);
}

void Halftoner::choose_largest(std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                               std::uint8_t* out) const noexcept {
  std::array<std::int32_t, kMixBlock> chosen;
  chosen.fill(1);
  MixRow most = fractions[0];
  for (std::size_t m = 1; m < plan_.material_count(); ++m) {
    for (std::size_t k = 0; k < kMixBlock; ++k) {
      const bool more = fractions[m][k] > most[k];
      chosen[k] = more ? static_cast<std::int32_t>(m) + 1 : chosen[k];
      most[k] = more ? fractions[m][k] : most[k];
    }
  }
  copy_numbers(chosen, begin, end, out);
}

}  // namespace ccslice
