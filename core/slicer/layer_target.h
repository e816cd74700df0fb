// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <span>

#include "core/base/cancellation.h"
#include "core/material/contone.h"
#include "core/raster/layer_window.h"
#include "core/raster/occupancy.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {

/// A layer to fill. The references must outlive it.
struct LayerTarget {
  LayerLattice lattice;
  double z_mm;
  std::span<ContonePlane> planes;
  LayerStats& stats;
  const CancellationToken& cancel;
  LayerWindow window;   // What the planes hold. Voxels elsewhere are left out,
  LayerWindow counted;  // and counts are of the voxels in here.

  bool is_whole() const { return window == window_of(lattice); }
  std::uint64_t count(const Span& span) const {
    const Span part = counted.clipped(span);
    return part.end - part.begin;
  }
};

}  // namespace ccslice
