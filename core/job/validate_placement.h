// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which placements x -> A x + t are taken, by everything that takes one. The scales of A are its singular values:
//
//   all entries finite;
//   the smallest scale more than 1e-9 of the largest (else A is as good as singular);
//   all scales within SliceLimits::min_placement_scale .. max_placement_scale, where tolerances that hold in the mesh's
//   frame still mean something in the world's;
//   |t_i| and the placed part within SliceLimits::max_abs_coordinate_mm of the world's origin.

#pragma once

#include "core/base/types.h"
#include "core/job/slice_limits.h"

namespace ccslice {

/// The matrix alone. Throws Error{kPlacementNonFinite, kPlacementSingular, kPlacementOutOfRange} naming the entry.
void validate_placement(const Placement& placement, const SliceLimits& limits = {});

/// The matrix and where it puts the eight corners of the solid's box (mesh frame). Throws as above.
void validate_placement(const Placement& placement, const Box3& solid_box, const SliceLimits& limits = {});

/// A placed box. Throws Error{kPlacementOutOfRange}. REQUIRES: not empty.
void validate_placed_box(const Box3& placed_box, const SliceLimits& limits = {});

}  // namespace ccslice
