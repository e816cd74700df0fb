// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Serialized ControlMesh -> ControlMesh, straight from the wire.
//
// Protobuf's own parser would build the whole message first: it can't be stopped, it knows no limits (an empty channel
// name takes 2 bytes on the wire and 32 in memory), and the mesh would be in memory twice. This reader polls a token,
// keeps the limits while it reads, and takes the same bytes to the same mesh: packed fields and not, in any order and
// in several pieces, the last value of a single field.

#pragma once

#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/validate.h"

namespace ccslice::server {

/// Memory that reading takes at most, per serialized byte: an id of one byte takes four, in a vector that grows by
/// doubling.
inline constexpr std::uint64_t kReadMemoryPerByte = 12;

/// `blocks`: the bytes, cut anywhere. REQUIRES: less than 2 GiB. Throws Error{kMeshMalformed, kMeshUnknownField,
/// kMeshArrayMismatch, kMeshUnsupportedCell, kMeshUnknownCellKind, kMeshTooLarge, kMeshBadChannel, kMeshBadCellRegion,
/// kMeshBadMidNode, kCancelled}.
ControlMesh read_control_mesh(const std::vector<std::string>& blocks, const MeshLimits& limits = {},
                              const CancellationToken& cancel = {});

}  // namespace ccslice::server
