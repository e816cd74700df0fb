// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Material channels for meshes that come without any, from the positions of the control points or from a file. A grade
// is written
//
//   NAME=FIELD[:OPTION]...   or   NAME=file:PATH
//
// FIELD    x, y or z: along that axis, over the bounding box of the control points
//          radial:    distance from an axis or a point, from the nearest control point to the farthest
//          distance:  distance of the control points from the boundary faces of the control mesh
//                     (core/mesh_authoring/boundary_distance.h), from 0 to the deepest control point
// OPTION   A..B       the channel's values at the two ends                        (default 0..1)
//          x, y or z  radial only: distance from the axis of that direction       (default: from a point)
//          @X,Y,Z     radial only: a point on the axis, or the point itself, mm   (default: the middle of the box)
//          DEPTH      distance only: the distance in mm from which on the channel has the value B
// PATH     a text file of one value for each vertex, in the order of the vertices, separated by white space; '#' opens
//          a comment
//
// for example  stiffness=z   hardness=x:20..95   dye=radial:z   dye=radial:1..0:@0,0,12.5   skin=distance:90..30:2.5
//              load=file:load.txt
//
// Every rule of the subdivision is an affine combination, the same for positions and channels. So a channel along an
// axis is that same linear function of position all over the limit. The others are followed as closely as the cells are
// small. By distance the outer surface has the value A all over, exactly, as it depends on boundary control points
// alone; a mesh whose control points all lie on the boundary has no depth, and the value A inside as well.

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/mesh/control_mesh.h"

namespace ccslice {

enum class GradeField { kX, kY, kZ, kRadialX, kRadialY, kRadialZ, kRadialPoint, kDistance, kFile };

struct Grade {
  std::string channel;
  GradeField field = GradeField::kX;
  double first = 0, last = 1;  // Values at the least and the greatest coordinate or distance.
  std::optional<Vec3> centre_mm;
  std::optional<double> depth_mm;  // kDistance: more than 0.
  std::string path;                // kFile.
};

/// Throws Error{kParameterInvalid} (field "grade") saying what is wrong and how a grade is written.
Grade parse_grade(std::string_view text);

/// Adds the channel to `mesh`. Where all control points have the same coordinate or distance it takes `first`. Returns
/// how deep the deepest control point lies, mm, for kDistance, and 0 for all others. Throws
/// Error{kMeshBadChannel} if there is a channel of that name; of a file also {kFileUnreadable, kFileSyntax,
/// kMeshNonFinite}, naming its path, the line and the token. REQUIRES: at least one vertex; for kDistance a mesh that
/// validate() takes.
double apply_grade(const Grade& grade, ControlMesh& mesh);

}  // namespace ccslice
