// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The place of a cell that is nearest to a point outside of it: min |geo(uvw) - point| over [0,1]^3.
//
// Newton's method (newton.h) is made to arrive at points that the cell holds. Of a point beside it a place on its
// boundary is nearest, and towards smooth edges with one hexahedron, where two columns of the Jacobian become parallel,
// Newton's steps are held at both sides at once and get stuck inside of the cell: within a micrometre of the nearest
// place, and a hundredth of a cell off it.
//
// So the method here is that of Levenberg and Marquardt. Each step minimizes
//
//     |J d - r|^2 + lambda sum_a |J_a|^2 d_a^2,  with uvw + d in [0,1]^3,
//
// exactly: a convex problem of three unknowns, whose minimum is that of one of 27 choices of coordinates held at an
// end. A step that leads away isn't taken, and lambda grows; it shrinks by how well steps do what the model says
// [Nielsen 1999]. Without lambda the error shrinks by the distance from the point times the surface's curvature at each
// step, which is little for voxels just off a part; where it is about 1, lambda has to stand for the curvature.
//
// On an irregular line or corner itself the Jacobian is that of the innermost sub-cell, and may point elsewhere. So a
// second run starts well inside of the cell.

#pragma once

#include "core/limit/newton.h"

namespace ccslice {

/// Starts at `start`, in [0,1]^3, and never leaves it for a place that is farther from the point. Stops where steps are
/// shorter than kAcceptOfCell, where nothing is left of the residual, or after some sixty steps.
NewtonResult nearest_in_cell(LimitEvaluator& evaluator, LimitCellId cell, const Vec3& start, const Vec3& point,
                             const Acceptance& acceptance) noexcept;

}  // namespace ccslice
