// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One material for every voxel, so that neighbourhoods have the mixing fractions that are asked for. A voxel's material
// follows from its fractions, its absolute index and the seed; with error diffusion also from the layer's voxels before
// it. Nothing depends on other layers: same bytes for any split.
//
//   thresholds  material m where F_m-1 <= t < F_m, F the cumulated fractions. The thresholds t are those of a
//               blue-noise mask (blue_noise_mask.h), shifted by the seed, or white noise. With one mask for all
//               materials the voxels of material m are those of an interval of ranks. Differences of two even patterns
//               are even themselves: below 1.5 cycles/mm they have at most a fiftieth of white noise's power, whatever
//               the interval (tests/bench/halftone_quality), and unlike masks of their own for each material they
//               neither overlap nor leave holes;
//   diffusion   error_diffusion.h;
//   largest fraction   the material of it, the first of several.

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/printing/blue_noise_mask.h"
#include "core/printing/error_diffusion.h"
#include "core/printing/mixture.h"
#include "core/printing/printing.h"

namespace ccslice {

/// The shape of the voxels of the mask that halftoning needs, if it needs one. REQUIRES: a pitch within the limits.
[[nodiscard]] std::optional<VoxelShape> mask_shape(const Printing& printing, double pitch_x_mm, double pitch_y_mm,
                                                   double pitch_z_mm);

/// What all workers on a job read.
class HalftonePlan {
 public:
  /// Makes the mask, where one is needed and hasn't been made. REQUIRES: validate_printing() passes. Throws
  /// Error{kCancelled}.
  HalftonePlan(const Printing& printing, double pitch_x_mm, double pitch_y_mm, double pitch_z_mm,
               const CancellationToken& cancel = {});

  const Printing& printing() const noexcept { return printing_; }
  std::size_t material_count() const noexcept { return printing_.materials.size(); }
  /// One for each map, in the order of maps_of().
  std::span<const Mixture> mixtures() const noexcept { return mixtures_; }
  /// Which of them a cell region's voxels are mixed by.
  std::size_t mixture_of(std::uint8_t cell_region) const noexcept { return mixture_of_region_[cell_region]; }
  const BlueNoiseMask* mask() const noexcept { return mask_.get(); }

 private:
  Printing printing_;
  std::vector<Mixture> mixtures_;
  std::array<std::uint16_t, 256> mixture_of_region_{};
  std::shared_ptr<const BlueNoiseMask> mask_;
};

/// One thread's worker on layers, whose rows come from 0 up. Blocks of a row are those of kMixBlock voxels at multiples
/// of it; their runs may come in any order, but see reverse().
class Halftoner {
 public:
  /// REQUIRES: plan outlives it.
  explicit Halftoner(const HalftonePlan& plan) : plan_(plan), diffusion_(plan.material_count()) {}

  void start_layer(std::uint32_t width, std::uint32_t layer);
  /// REQUIRES: ascending y within a layer.
  void start_row(std::uint32_t y);
  /// Whether the runs of this row, and the blocks of each, are to come from right to left.
  bool reverse() const noexcept { return reverse_; }

  /// Voxels [begin, end) of block `block`, mixed of fractions[.][begin..end), get their materials at
  /// out[begin..end). 0 <= begin < end <= kMixBlock.
  void choose(std::uint32_t block, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
              std::uint8_t* out) noexcept;

 private:
  void choose_by_thresholds(const MixRow& thresholds, std::uint32_t begin, std::uint32_t end,
                            const Fractions& fractions, std::uint8_t* out) const noexcept;
  void choose_largest(std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                      std::uint8_t* out) const noexcept;

  const HalftonePlan& plan_;
  std::uint32_t layer_ = 0, row_ = 0;
  std::uint32_t key_ = 0;  // Key of the row's random numbers.
  bool reverse_ = false;
  MixRow thresholds_{};  // The same for every block of the row, as the mask's edge is a block.
  ErrorDiffusion diffusion_;
};

}  // namespace ccslice
