// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The calls that have a unit of their own each: begin_slice_call() is in slice_call.cpp, and so on. `request`, the
// bytes of the method's message, and `response` live until the call is done.

#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/service.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// What the server knows about a mesh.
grpc::ServerUnaryReactor* begin_get_mesh_call(ServiceState& state, grpc::CallbackServerContext& context,
                                              const grpc::ByteBuffer& request, v1::GetMeshResponse& response);

/// What slicing would give.
grpc::ServerUnaryReactor* begin_plan_call(ServiceState& state, grpc::CallbackServerContext& context,
                                          const grpc::ByteBuffer& request, v1::PlanSlicesResponse& response);

/// Receives a mesh and prepares it, or waits for another call that does.
grpc::ServerReadReactor<grpc::ByteBuffer>* begin_upload_call(ServiceState& state, grpc::CallbackServerContext& context,
                                                             v1::UploadMeshResponse& response);

/// A stream of layers.
grpc::ServerWriteReactor<v1::SliceRangeResponse>* begin_slice_call(ServiceState& state,
                                                                   grpc::CallbackServerContext& context,
                                                                   const grpc::ByteBuffer& request);

/// A stream of vertices and triangles.
grpc::ServerWriteReactor<v1::TessellateBoundaryResponse>* begin_tessellate_call(ServiceState& state,
                                                                                grpc::CallbackServerContext& context,
                                                                                const grpc::ByteBuffer& request);

/// Batches of points, answered in order.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::ProbePointsResponse>* begin_probe_call(
    ServiceState& state, grpc::CallbackServerContext& context);
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::EvaluatePointsResponse>* begin_evaluate_call(
    ServiceState& state, grpc::CallbackServerContext& context);

/// Pictures of cuts, of which the latest wins.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PreviewResponse>* begin_preview_call(
    ServiceState& state, grpc::CallbackServerContext& context);

}  // namespace ccslice::server
