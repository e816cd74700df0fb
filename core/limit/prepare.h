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

/// Levels of patches looked at towards an irregular line or vertex.
inline constexpr int kFoldLevels = 3;

/// Looks for places where det J <= 0: fills folding_cells, fold_boxes and the summary's folds. REQUIRES: cell_boxes.
///
/// Conclusive for every patch that it looks at (fold_search.h): it folds, it doesn't, or it counts as undecided, which
/// the inversion treats as folding. Towards an irregular line or vertex it looks at the first kFoldLevels levels of
/// patches (one level along the lines of a vertex cell): what is nearer follows the subdivision's own map, which
/// doesn't fold. Bounded by a number of steps for each patch and for the whole solid.
void find_folds(const CancellationToken& cancel, LimitSolid::Data& data);

/// Finds the cells whose boxes meet those of a separate part of the solid (one that shares no vertex): fills
/// overlap_boxes and parts. REQUIRES: cell_boxes.
void find_overlaps(const ControlMesh& mesh, const CancellationToken& cancel, LimitSolid::Data& data);

}  // namespace ccslice
