// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Vector error diffusion in a layer (R. Floyd, L. Steinberg, An adaptive algorithm for spatial greyscale, Proc. SID 17,
// 1976; serpentine). A voxel takes the material whose fraction plus carried error is largest; what the choice is off
// by, a vector over the materials, goes on to the voxels that come next, 7/16 in the row and 3/16, 5/16, 1/16 in the
// next one. Errors stay bounded, so that fractions over an area are off by its edge only.
//
// Alone, this makes the same patterns in every layer, and columns along z. So random numbers of (voxel, layer, seed)
// perturb the choice, not the errors: fractions stay as exact, and neighbouring layers don't correlate. The direction
// of the rows alternates, and starts with another one in every other layer.
//
// At the boundary as many errors must come in as leave, or else the voxels there have too little of what is rare:
// errors inside aren't 0 on average, but positive for rare materials. What leaves a row at its end enters the next row,
// which starts there, or the row's next run, unless that is far. Other errors that fall on voxels outside the solid are
// dropped, and for each share that a voxel would get from there it gets one of an error that is made up: as large on
// average as errors inside (measured), evenly spread beyond that along any line and from layer to layer, so that sums
// over many voxels are hardly off. Materials that are absent are never chosen, whatever the errors.
//
// Layers know nothing of each other, so the errors that a cube's layers leave at its sides add up: in cubes of 10,000
// voxels to 8 (rms), whatever the fraction is. For a fraction of 5 % that is 1.7 %, and at 0.1 % a row goes on for
// millimetres before errors make a voxel. So materials of less than kMinorFraction are placed first, where a sequence
// that fills space evenly along rows, from row to row and from layer to layer is below their fraction. The others share
// what is left, with errors among them. A voxel that one material is left for carries none: it is outside to them.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/printing/mixture.h"

namespace ccslice {

/// Materials of smaller fractions are placed by an even sequence, not by errors.
inline constexpr float kMinorFraction = 0.2f;

class ErrorDiffusion {
 public:
  explicit ErrorDiffusion(std::size_t materials) : materials_(materials) {}

  /// No errors.
  void start_layer(std::uint32_t width);
  /// Random numbers of a row.
  struct RowNumbers {
    std::uint32_t key;    // Key of white noise.
    std::uint32_t phase;  // Phase of the sequence that errors from outside are made of.
    std::uint32_t minor;  // Phase of the sequence that places minor materials: minor_phase().
  };
  /// Follows from the absolute row and layer.
  static std::uint32_t minor_phase(std::uint64_t seed, std::uint32_t y, std::uint32_t z) noexcept;
  /// Goes on to a row, `rows` after the one before. REQUIRES: rows that follow on one another (rows = 1) have opposite
  /// directions.
  void start_row(std::uint32_t rows, bool reverse, const RowNumbers& numbers);
  /// Voxels [begin, end) of the block of kMixBlock columns from `first` on. REQUIRES: runs come in the row's direction.
  void choose(std::uint32_t first, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
              std::uint8_t* out) noexcept;

 private:
  using Errors = float __attribute__((vector_size(4 * kMaxPrintMaterials)));
  /// Voxels of a block, in the row's direction.
  struct Run {
    std::uint32_t first;  // Column of the block.
    std::uint32_t start;  // Voxel of the block that comes first.
    std::uint32_t length;
    std::int32_t step;
  };

  static constexpr std::int64_t kNowhere = -(std::int64_t{1} << 40);

  void carry(std::uint32_t first, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
             std::uint8_t* out) noexcept;
  void choose_with_minor(std::uint32_t first, std::uint32_t begin, std::uint32_t end, const Fractions& fractions,
                         std::uint8_t* out) noexcept;
  template <typename FromRow, typename FromAbove>
  void start_run(const Run& run, const FromRow& from_row, const FromAbove& from_above) noexcept;
  float share_from_outside(const Run& run, std::uint32_t k) const noexcept;
  void choose_of_two(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept;
  void choose_of_many(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept;

  std::size_t materials_;
  bool reverse_ = false;
  RowNumbers numbers_{};
  // By column, one column of margin each side. With two materials the first one's errors, which are the other's
  // negated.
  std::vector<float> here_, below_;
  std::vector<Errors> many_here_, many_below_;
  std::vector<std::uint8_t> inside_here_, inside_above_;  // By column: 1 inside the solid, where runs have come.
  std::int64_t next_ = kNowhere;                          // The column that the last error goes on to.
  float error_ = 0;
  Errors many_error_{};
};

}  // namespace ccslice
