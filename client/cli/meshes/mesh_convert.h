// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Control meshes between the contract's message, which files and uploads hold, and the core's type, which readers,
// grades and checks use; and what is measured of them, as the contract has it.

#pragma once

#include "ccslice/v1/mesh.pb.h"
#include "core/mesh/control_mesh.h"
#include "core/prepare/deviation.h"

namespace ccslice::cli {

v1::ControlMesh to_proto(const ControlMesh& mesh);
v1::Vector3 to_proto(const Vec3& vector);
v1::Box3 to_proto(const Box3& box);
v1::LimitDeviation to_proto(const Deviation& deviation);
v1::CellRegion to_proto(const CellRegionSummary& region);
/// The limit's box and deviation, its folds and overlaps; not what a server counts besides.
v1::MeshSummary to_proto(const SolidSummary& solid);

/// Throws Error{kMeshArrayMismatch, kMeshUnsupportedCell, kMeshUnknownCellKind} if the arrays don't make a mesh.
ControlMesh from_proto(const v1::ControlMesh& message);

}  // namespace ccslice::cli
