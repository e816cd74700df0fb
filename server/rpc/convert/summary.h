// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What the contract says about a prepared mesh (MeshSummary), and about one that is being prepared.

#pragma once

#include <string>

#include "ccslice/v1/mesh.pb.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

v1::MeshSummary summarize(const ListedMesh& listed);

/// The summary of a mesh that has just been found or prepared.
v1::MeshSummary summarize(MeshCache& cache, const MeshPtr& mesh);

/// How far a mesh is.
v1::GetPreparationResponse preparation_of(MeshCache& cache, const std::string& mesh_id);

}  // namespace ccslice::server
