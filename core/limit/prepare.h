// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The steps from a validated control mesh to a prepared solid. Private to core/limit.

#pragma once

#include "core/base/cancellation.h"
#include "core/limit/solid_data.h"
#include "core/mesh/control_mesh.h"

namespace ccslice {

/// Refines where necessary, classifies, numbers the limit-ready cells, walks their rings and makes the operators; finds
/// the boundary faces. Fills points, rings, cells, operators, faces, face_rings and the counts of the summary.
/// Throws Error{kMeshTooLarge} if operators or rings outgrow the limits, Error{kCancelled}.
void build_cells(const ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel,
                 LimitSolid::Data& data);

/// Fills cell_boxes.
void build_cell_boxes(const CancellationToken& cancel, LimitSolid::Data& data);

/// Looks for places where det J <= 0: fills folding_cells, fold_boxes and the summary's folds. REQUIRES: cell_boxes.
///
/// A patch whose derivative vectors all stay near those at its middle certainly doesn't fold; others are halved and
/// looked at again, then sampled. Whatever is reported does fold; a fold much smaller than an eighth of a patch can be
/// missed.
void find_folds(const CancellationToken& cancel, LimitSolid::Data& data);

}  // namespace ccslice
