// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A plane anywhere through a placed part, and the pixels in it. It is a layer of one more placement: the frame R with
// columns (across, up, across x up) turns plane coordinates into the world's, so R^T * placement lays the part under
// horizontal planes, and the picture is the layer at height (R^T middle).z of a grid as fine as its pixels. Planes of
// one orientation differ in the grid's origin alone, so they share whatever depends on the placed part only.

#pragma once

#include <cstdint>

#include "core/base/types.h"
#include "core/job/grid.h"
#include "core/job/slice_limits.h"

namespace ccslice {

inline constexpr std::uint32_t kMaxPreviewPixels = 2048;  // Each way.

struct PreviewPlane {
  Vec3 middle_mm = Vec3::Zero();  // Of the picture, world frame.
  Vec3 across = Vec3::UnitX();    // From the picture's left to its right: a unit vector.
  Vec3 up = Vec3::UnitY();        // From its bottom to its top: a unit vector, at right angles to `across`.
  double across_mm = 1;           // A pixel's width,
  double up_mm = 1;               // and its height.
  std::uint32_t columns = 0, rows = 0;
};

/// Throws Error{kPlaneInvalid} unless the middle is finite and within the limits, and the axes are of unit length and
/// at right angles to 1e-6, Error{kPitchInvalid, kPitchOutOfRange} for pixels that can't be voxels, and
/// Error{kPictureTooLarge} for pictures of no or too many pixels.
void validate_plane(const PreviewPlane& plane, const SliceLimits& limits = {});

/// From plane coordinates to the world: a rotation. REQUIRES: validate_plane() passes.
Mat3 frame_of(const PreviewPlane& plane);

/// R^T * placement.
Placement under_plane(const PreviewPlane& plane, const Placement& placement);

/// The picture as a grid of one layer under the plane, as thick as the smaller side of a pixel; row 0 is the picture's
/// lowest. `part_box` stays empty.
Grid grid_of(const PreviewPlane& plane);

/// The same picture in pixels `times` as wide and as high, rounded up to whole ones; the upper left corner stays.
PreviewPlane coarser(const PreviewPlane& plane, std::uint32_t times);

}  // namespace ccslice
