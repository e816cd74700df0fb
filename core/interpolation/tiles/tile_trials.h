// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cells of few voxels are left to tiles (interpolation/tiles/tile_tree.h), which pay if one cubic fits across several
// cells. That depends on how steep and how smooth materials are, for the tolerance: as meshed slopes jump between
// cells, and no cubic spans a kink. TRIALS are what decides: for a whole job some boxes of its cells, within a tile its
// first parts.

#pragma once

#include <cstdint>
#include <memory>

#include "core/base/cancellation.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_solid.h"

namespace ccslice {

/// Tries tiles around five cells of few voxels inside of the solid, and around five on its boundary. True if at least
/// half of each five fit. The answer follows from the solid and the spec alone. Takes a millisecond or two where cells
/// are few, and polls `cancel` among the cells and before each trial. Throws Error{kCancelled}. REQUIRES: all
/// tolerances positive.
[[nodiscard]] bool do_tiles_fit(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec,
                                const CancellationToken& cancel);

/// Which parts of a tile are tried. Half as many voxels may be skipped as were tried or skipped in vain since the last
/// fit, so of a tile in which nothing fits little is tried.
class TileTrials {
 public:
  /// `promising`: fits are likely.
  explicit TileTrials(bool promising = true) : promising_(promising) {}

  /// A part of so many voxels needn't be tried, and isn't.
  bool skip(std::uint64_t voxels);
  /// A part was tried.
  void note(std::uint64_t voxels, bool fits);
  /// Large parts may be tried, although much is sampled for them.
  bool are_promising() const { return promising_; }

 private:
  bool promising_;
  std::uint64_t failed_ = 0, to_skip_ = 0;  // Voxels since a fit, and how many more may be skipped.
};

}  // namespace ccslice
