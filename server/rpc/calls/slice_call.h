// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The call SliceRange: a stream of layers.

#pragma once

#include "ccslice/v1/slice.pb.h"
#include "server/rpc/calls/stream_call.h"

namespace ccslice::server {

/// Begins a call of SliceRange. `request`, a v1::SliceRangeRequest, lives until the call is done.
grpc::ServerWriteReactor<v1::SliceRangeResponse>* begin_slice_call(ServiceState& state,
                                                                   grpc::CallbackServerContext& context,
                                                                   const grpc::ByteBuffer& request);

}  // namespace ccslice::server
