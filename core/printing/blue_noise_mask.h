// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A three-dimensional dither mask by void and cluster (R. Ulichney, The void-and-cluster method for dither array
// generation, Proc. SPIE 1913, 1993), 64 x 64 x 64 voxels, periodic, for voxels that aren't cubes.
//
// Every voxel of the tile has a rank; the voxels of rank < f N are a share f of all, spread as evenly as can be: each
// rank goes to the voxel in the largest void that those before it leave. A void is measured by a truncated Gaussian
// exp(-d^2 / (2 s^2)), d in millimetres, s = 1.5 times the edge of a cube of a voxel's volume, wrapped round the tile.
// What matters of the pitch is therefore its ratio x : y : z.
//
// A plane of such a mask has more or fewer low ranks than its share, by as much as 1.5 % of its voxels, and so would
// have every layer of a print. So planes z = const are balanced: each voxel set adds a little to the energy of its
// whole plane. That leaves 0.1 % and costs nothing elsewhere in the spectrum.
//
// Energies are integers (the kernel in 24 bits), so that no rounding accumulates and equal voids tie exactly; a hash of
// the voxel decides those. The mask is the same on every machine.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/base/cancellation.h"

namespace ccslice {

inline constexpr std::uint32_t kMaskEdge = 64;  // A power of two.
inline constexpr std::size_t kMaskVoxels = std::size_t{kMaskEdge} * kMaskEdge * kMaskEdge;

/// Edges of a voxel relative to that of a cube of the same volume.
struct VoxelShape {
  double x = 1, y = 1, z = 1;
};

/// The shape for a pitch, rounded to steps of 2^(1/64) and no longer or shorter than 8 : 1, so that nearly equal
/// pitches share a mask. Voxels that are longer along x than twice that cube's edge take the shape of less slender
/// ones, with an edge of 2, so that each mask takes about a second. REQUIRES: positive, finite.
VoxelShape voxel_shape(double pitch_x_mm, double pitch_y_mm, double pitch_z_mm);

class BlueNoiseMask {
 public:
  /// Takes about a second. Throws Error{kCancelled}.
  explicit BlueNoiseMask(const VoxelShape& shape, const CancellationToken& cancel = {});

  /// A row along x, wrapped: voxel x of it has threshold row[x % kMaskEdge], in (0, 1): (rank + 1/2) / 2^18. A
  /// share f of all thresholds is below f.
  std::span<const float, kMaskEdge> row(std::uint32_t y, std::uint32_t z) const noexcept {
    const std::size_t first = (std::size_t{z % kMaskEdge} * kMaskEdge + y % kMaskEdge) * kMaskEdge;
    return std::span<const float, kMaskEdge>(&thresholds_[first], kMaskEdge);
  }

  static constexpr std::size_t memory_bytes() noexcept { return kMaskVoxels * sizeof(float); }

 private:
  std::vector<float> thresholds_;  // By z, y, x.
};

/// The mask of a shape. Made at its first use in this process, then shared; the kMaskCacheSize used last are kept,
/// which bounds what the cache holds to kMaskCacheSize * memory_bytes(). Thread-safe: whoever needs a mask that is
/// being made waits for it, and nobody waits for the mask of another shape. Throws Error{kCancelled} within
/// milliseconds of a cancel.
[[nodiscard]] std::shared_ptr<const BlueNoiseMask> shared_mask(const VoxelShape& shape,
                                                               const CancellationToken& cancel = {});

/// Whether shared_mask() would answer at once.
bool has_shared_mask(const VoxelShape& shape);

inline constexpr std::size_t kMaskCacheSize = 8;

}  // namespace ccslice
