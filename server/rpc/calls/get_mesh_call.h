// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call GetMesh: what the server knows about a mesh.

#pragma once

#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/mesh.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// Begins a call of GetMesh. `request`, a v1::GetMeshRequest, and `response` live until the call is done.
grpc::ServerUnaryReactor* begin_get_mesh_call(ServiceState& state, grpc::CallbackServerContext& context,
                                              const grpc::ByteBuffer& request, v1::GetMeshResponse& response);

}  // namespace ccslice::server
