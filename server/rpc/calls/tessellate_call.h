// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call TessellateBoundary: a stream of vertices and triangles.

#pragma once

#include "ccslice/v1/surface.pb.h"
#include "server/rpc/calls/stream_call.h"

namespace ccslice::server {

/// Begins a call of TessellateBoundary. `request`, a v1::TessellateBoundaryRequest, lives until the call is done.
grpc::ServerWriteReactor<v1::TessellateBoundaryResponse>* begin_tessellate_call(ServiceState& state,
                                                                                grpc::CallbackServerContext& context,
                                                                                const grpc::ByteBuffer& request);

}  // namespace ccslice::server
