// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include "core/base/cancellation.h"
#include "core/mesh/validate.h"
#include "server/service/mesh_cache.h"
#include "server/service/upload.h"

namespace ccslice::server {

/// From the bytes of an upload to a prepared solid. Frees the bytes as soon as they are parsed. For a worker thread.
/// Throws Error (1xx, kCancelled).
PreparedMesh prepare_mesh(Upload& upload, const MeshLimits& limits, const CancellationToken& cancel);

}  // namespace ccslice::server
