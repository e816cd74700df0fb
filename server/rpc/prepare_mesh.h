// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads, validates and prepares an uploaded mesh, within the memory that the server has for it.

#pragma once

#include "core/base/cancellation.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/validate.h"
#include "server/service/mesh_cache.h"
#include "server/service/upload.h"

namespace ccslice::server {

/// Prepares the bytes of an upload, and frees them as soon as they are read. Reserves memory in the budget of all
/// preparations, estimated first from the bytes, then from the mesh and its refinement. Computes on up to `threads`
/// threads. MUST run on a worker thread.
/// Throws Error (1xx, kCancelled), ServiceError{kMeshExceedsMemory, kServerBusy}.
PreparedMesh prepare_mesh(UploadedBytes& bytes, const MeshLimits& limits, int threads, MemoryBudget& budget,
                          const CancellationToken& cancel);

}  // namespace ccslice::server
