// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Control meshes between the contract's message, which files and uploads hold, and the core's type, which readers,
// grades and checks use.

#pragma once

#include "ccslice/v1/mesh.pb.h"
#include "core/mesh/control_mesh.h"

namespace ccslice::cli {

v1::ControlMesh to_proto(const ControlMesh& mesh);

/// Throws Error{kMeshArrayMismatch, kMeshUnsupportedCell, kMeshUnknownCellKind} if the arrays don't make a mesh.
ControlMesh from_proto(const v1::ControlMesh& message);

}  // namespace ccslice::cli
