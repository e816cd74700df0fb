// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The calls ProbePoints and EvaluatePoints: batches of points, answered in order.

#pragma once

#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/points.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// Begins a call of ProbePoints.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::ProbePointsResponse>* begin_probe_call(
    ServiceState& state, grpc::CallbackServerContext& context);

/// Begins a call of EvaluatePoints.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::EvaluatePointsResponse>* begin_evaluate_call(
    ServiceState& state, grpc::CallbackServerContext& context);

}  // namespace ccslice::server
