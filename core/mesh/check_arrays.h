// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The rules of a control mesh that need no topology: sizes, names, numbers, indices.

#pragma once

#include "core/mesh/validate.h"

namespace ccslice {

/// Takes time in proportion to the arrays. Throws Error naming the field, with its index, and the ids: kMeshEmpty,
/// kMeshTooLarge, kMeshArrayMismatch, kMeshBadChannel, kMeshNonFinite, kMeshCoordinateOutOfRange, kMeshIndexOutOfRange,
/// kMeshRepeatedVertex, kMeshIsolatedVertex, kMeshValenceTooHigh, kMeshBadCellRegion; and kCancelled.
void check_arrays(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel);

}  // namespace ccslice
