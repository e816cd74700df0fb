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
// Errors that fall on voxels outside the solid are dropped. Voxels that would get theirs from there get random ones
// instead, as large on average as errors are inside (measured): without them the first rows would all look alike, and
// have too little of what is rare. Materials that are absent are never chosen, whatever the errors.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/material/mixture.h"

namespace ccslice {

class ErrorDiffusion {
 public:
  explicit ErrorDiffusion(std::size_t materials) : materials_(materials) {}

  /// No errors.
  void start_layer(std::uint32_t width);
  /// Goes on to a row, `rows` after the one before (1 but for rows left out), in a direction of its own.
  void start_row(std::uint32_t rows, bool reverse, std::uint32_t key);
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

  template <typename FromRow, typename FromAbove>
  void start_run(const Run& run, const FromRow& from_row, const FromAbove& from_above) noexcept;
  void choose_of_two(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept;
  void choose_of_many(const Run& run, const Fractions& fractions, std::uint8_t* out) noexcept;

  std::size_t materials_;
  bool reverse_ = false;
  std::uint32_t key_ = 0;
  // By column, one column of margin each side. With two materials the first one's errors, which are the other's
  // negated.
  std::vector<float> here_, below_;
  std::vector<Errors> many_here_, many_below_;
  std::vector<std::uint8_t> inside_here_, inside_above_;  // By column, with a margin of a block.
  std::int64_t next_ = -1;                                // The column that the last error goes on to.
  float error_ = 0;
  Errors many_error_{};
};

}  // namespace ccslice
