// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call PlanSlices: what slicing would give.

#pragma once

#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/plan.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// Begins a call of PlanSlices. `request`, a v1::PlanSlicesRequest, and `response` live until the call is done.
grpc::ServerUnaryReactor* begin_plan_call(ServiceState& state, grpc::CallbackServerContext& context,
                                          const grpc::ByteBuffer& request, v1::PlanSlicesResponse& response);

}  // namespace ccslice::server
