// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Occupancy [Luu19, 3.2.1]: a voxel is inside if the contours' winding number at its centre isn't zero. The answer of
// the paper's test per voxel at the cost of the crossings only: scan conversion.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/contour/contour.h"
#include "core/raster/layer_window.h"
#include "core/raster/voxel_runs.h"

namespace ccslice {

/// One bit a voxel, rows padded to whole bytes, most significant bit first (PBM's and PNG's order). Row j holds y_j.
struct BitImage {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t row_bytes = 0;
  std::vector<std::uint8_t> bits;

  BitImage() = default;
  BitImage(std::uint32_t w, std::uint32_t h)
      : width(w), height(h), row_bytes((w + 7) / 8), bits(std::size_t{row_bytes} * h) {}
  /// All 0, in the memory that there is.
  void clear(std::uint32_t w, std::uint32_t h) {
    width = w;
    height = h;
    row_bytes = (w + 7) / 8;
    bits.assign(std::size_t{row_bytes} * h, 0);
  }
  bool get(std::uint32_t x, std::uint32_t y) const {
    return bits[std::size_t{row_bytes} * y + x / 8] >> (7 - x % 8) & 1;
  }
};

/// The voxel centres of a layer in the plane's coordinates: x_i = x0 + (i + 1/2) * dx, y_j likewise. mm.
struct LayerLattice {
  double x0_mm = 0, y0_mm = 0;
  double dx_mm = 1, dy_mm = 1;
  std::uint32_t width = 0, height = 0;

  Vec3 centre(std::uint32_t x, std::uint32_t y, double z_mm) const {
    return {x0_mm + (x + 0.5) * dx_mm, y0_mm + (y + 0.5) * dy_mm, z_mm};
  }
};

/// All of a layer.
inline LayerWindow window_of(const LayerLattice& lattice) { return {0, 0, lattice.width, lattice.height}; }

/// Maximal runs of voxels inside, by row, then by column. A centre exactly on a contour belongs to the side of larger x
/// (of larger y on horizontal edges): half-open, so that abutting solids share no voxel. `rows`: those wanted.
/// Throws Error{kCancelled}.
std::vector<VoxelRun> rasterize(const Contours& contours, const LayerLattice& lattice, const RowRange& rows = {},
                                const CancellationToken& cancel = {});

BitImage to_bit_image(std::span<const VoxelRun> spans, std::uint32_t width, std::uint32_t height);
/// The same, in the memory that `image` has.
void draw_bits(std::span<const VoxelRun> spans, std::uint32_t width, std::uint32_t height, BitImage& image);

}  // namespace ccslice
