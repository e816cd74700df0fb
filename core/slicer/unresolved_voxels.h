// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Voxels of one layer inside the contours that inversion didn't reach. No voxel stays without a material: each takes
// the samples of the nearest solved voxel of the layer (ties: lower row, then lower column); if the layer has none, it
// takes the nearest parameter of the whole solid.

#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/material/contone.h"
#include "core/raster/occupancy.h"
#include "core/slicer/layer_slicer.h"
#include "core/slicer/material_field.h"

namespace ccslice {

class UnresolvedVoxels {
 public:
  void clear() { runs_.clear(); }
  /// By row, then by column.
  void add(std::uint32_t row, std::uint32_t column);

  /// Gives them their samples and counts them. `spans`: all voxels inside; those that weren't added are solved.
  /// Throws Error{kCancelled}, and Error{kInternal} if even the last resort finds nothing.
  void fill(MaterialField& field, std::span<const Span> spans, const LayerLattice& lattice, double z_mm,
            std::span<ContonePlane> planes, LayerStats& stats, const CancellationToken& cancel) const;

 private:
  void fill_from_solid(MaterialField& field, const LayerLattice& lattice, double z_mm, std::span<ContonePlane> planes,
                       const CancellationToken& cancel) const;

  std::vector<Span> runs_;
};

}  // namespace ccslice
