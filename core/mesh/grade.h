// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Material channels from the positions of the control points, for meshes that come without any. A grade is written
//
//   NAME=FIELD[:OPTION]...
//
// FIELD    x, y or z: along that axis, over the bounding box of the control points
//          radial:    distance from an axis or a point, from the nearest control point to the farthest
// OPTION   A..B       the channel's values at the two ends                        (default 0..1)
//          x, y or z  radial only: distance from the axis of that direction       (default: from a point)
//          @X,Y,Z     radial only: a point on the axis, or the point itself, mm   (default: the middle of the box)
//
// for example  stiffness=z   hardness=x:20..95   dye=radial:z   dye=radial:1..0:@0,0,12.5
//
// Every rule of the subdivision is an affine combination, the same for positions and channels. So a channel along an
// axis is that same linear function of position all over the limit; a radial one is followed as closely as the cells
// are small.

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/mesh/control_mesh.h"

namespace ccslice {

enum class GradeField { kX, kY, kZ, kRadialX, kRadialY, kRadialZ, kRadialPoint };

struct Grade {
  std::string channel;
  GradeField field = GradeField::kX;
  double first = 0, last = 1;  // Values at the least and the greatest coordinate or distance.
  std::optional<Vec3> centre_mm;
};

/// Throws Error{kParameterInvalid} (field "grade") saying what is wrong and how a grade is written.
Grade parse_grade(std::string_view text);

/// Adds the channel to `mesh`. Where all control points have the same coordinate or distance it takes `first`. Throws
/// Error{kMeshBadChannel} if there is a channel of that name. REQUIRES: at least one vertex.
void apply_grade(const Grade& grade, ControlMesh& mesh);

}  // namespace ccslice
