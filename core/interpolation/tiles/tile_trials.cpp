// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_trials.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/interpolation/samples/small_cells.h"
#include "core/interpolation/samples/voxel_blocks.h"
#include "core/interpolation/tiles/tile_fitter.h"
#include "core/limit/cell_index.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kTrials = 5;
constexpr double kAround = 0.25;       // As a share of a cell's size: how far a trial's box goes beyond it.
constexpr double kFewestVoxels = 256;  // Of a trial's box.

}  // namespace

bool do_tiles_fit(const std::shared_ptr<const LimitSolid>& solid, const InterpolationSpec& spec,
                  const CancellationToken& cancel) {
  const Placement voxel_of_mesh = ccslice::voxel_of_mesh(spec.placement, spec.grid);
  const SmallCells small(solid, voxel_of_mesh.inverse(Eigen::Affine), true);
  TileFitter fitter(solid, spec, nullptr);
  const auto fits_around = [&](LimitCellId cell) {
    cancel.throw_if_cancelled();
    Box3 box = grown(solid->index().cell_boxes.box(cell).transformed(voxel_of_mesh), kAround);
    const double voxels = std::max(box.volume(), 1.0);
    if (voxels < kFewestVoxels) box = grown(box, 0.5 * (std::cbrt(kFewestVoxels / voxels) - 1));
    const auto count = static_cast<std::uint64_t>(std::max(voxels, kFewestVoxels));
    return fitter.fit(fitter.particles().enter(box, count, {}), box, count) == TileFitter::Outcome::kFits;
  };
  // The cells' volume is cut into fifths, in their order: the cell in the middle of each is tried.
  PeriodicPoll poll(cancel);
  const auto most_fit = [&](bool at_boundary) {
    const auto volume_of = [&](LimitCellId cell) {
      poll();
      const bool meant = small.contain(cell) && (solid->boundary_sides(cell) != 0) == at_boundary;
      return meant ? solid->index().volume_mm3(cell) : 0;
    };
    double whole = 0, so_far = 0;
    for (const LimitCellId cell : solid->cells()) whole += volume_of(cell);
    std::uint32_t tried = 0, fits = 0;
    for (const LimitCellId cell : solid->cells()) {
      const double volume = volume_of(cell);
      so_far += volume;
      if (!(volume > 0 && so_far * kTrials > whole * (tried + 0.5))) continue;
      ++tried;
      fits += fits_around(cell);
      if (2 * fits >= kTrials || 2 * (tried - fits) > kTrials) break;  // The others change nothing.
    }
    return 2 * fits >= tried;
  };
  return !small.are_some() || (most_fit(false) && most_fit(true));
}

bool TileTrials::skip(std::uint64_t voxels) {
  if (voxels > to_skip_) return false;
  to_skip_ -= voxels;
  failed_ += voxels;
  return true;
}

void TileTrials::note(std::uint64_t voxels, bool fits) {
  promising_ = fits;
  failed_ = fits ? 0 : failed_ + voxels;
  to_skip_ = failed_ / 2;
}

}  // namespace ccslice
