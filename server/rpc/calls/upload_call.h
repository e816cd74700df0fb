// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call UploadMesh: receives a mesh and prepares it, or waits for another call that does.

#pragma once

#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/mesh.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// Begins a call of UploadMesh. `response` lives until the call is done.
grpc::ServerReadReactor<grpc::ByteBuffer>* begin_upload_call(ServiceState& state, grpc::CallbackServerContext& context,
                                                             v1::UploadMeshResponse& response);

}  // namespace ccslice::server
