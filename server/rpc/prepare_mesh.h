// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Reads, validates and prepares an uploaded mesh, within the memory that the server has for it.

#pragma once

#include <functional>

#include "core/base/cancellation.h"
#include "server/rpc/service_state.h"
#include "server/service/mesh_cache.h"
#include "server/service/upload.h"

namespace ccslice::server {

/// Prepares the bytes of a mesh; `when_read` runs as soon as they aren't needed any more. Reserves memory in the budget
/// of all preparations, estimated first from the bytes, then from the mesh and its refinement. Tells `progress`
/// how far it is. MUST run on a worker thread.
/// Throws Error (1xx, kCancelled), ServiceError{kMeshExceedsMemory, kServerBusy}.
PreparedMesh prepare_mesh(ServiceState& state, const UploadedBytes& bytes, const std::function<void()>& when_read,
                          const CancellationToken& cancel, PreparationProgress& progress);

}  // namespace ccslice::server
