// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Planes of pictures as the command line names them, and how a part's box fits into a picture of one.

#pragma once

#include <cstdint>
#include <string>

#include "ccslice/v1/geometry.pb.h"
#include "ccslice/v1/preview.pb.h"
#include "core/base/types.h"

namespace ccslice::cli {

/// Axes are unit vectors at right angles to each other; the viewer looks against the normal.
struct CutPlane {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ(), across = Vec3::UnitX(), up = Vec3::UnitY();
};

/// "z=12.5", or "X,Y,Z:NX,NY,NZ": a point in mm and a normal of any length. Up in the picture is z, as far as it can
/// be, or y where the plane is level. Throws UsageError.
CutPlane parse_cut_plane(const std::string& text);

/// A picture of the plane that holds the box's shadow on it, with `pixels` along the longer side.
struct FramedCut {
  v1::FreePlane plane;
  std::uint32_t width = 0, height = 0;
};
FramedCut frame_cut(const CutPlane& plane, const v1::Box3& box, std::uint32_t pixels);

/// The plane moved along its normal to a share of the box's extent in that direction.
CutPlane moved_to(const CutPlane& plane, const v1::Box3& box, double share);

/// Along the normal, mm.
double height_of(const CutPlane& plane);

}  // namespace ccslice::cli
