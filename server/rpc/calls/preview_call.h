// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call Preview: pictures of cuts, of which the latest wins.

#pragma once

#include <grpcpp/support/byte_buffer.h>
#include <grpcpp/support/server_callback.h>

#include "ccslice/v1/preview.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

/// Begins a call of Preview.
grpc::ServerBidiReactor<grpc::ByteBuffer, v1::PreviewResponse>* begin_preview_call(
    ServiceState& state, grpc::CallbackServerContext& context);

}  // namespace ccslice::server
