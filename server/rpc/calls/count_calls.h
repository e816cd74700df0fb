// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Tells the table of connections of every call, whichever service of the server it is for: one begins when gRPC has
// its request (its headers, where requests come as a stream), and ends when gRPC is done with it. And of every message
// that has come in whole.

#pragma once

#include <grpcpp/support/server_interceptor.h>

#include <memory>
#include <vector>

#include "server/service/network/connection_table.h"

namespace ccslice::server {

using InterceptorFactories = std::vector<std::unique_ptr<grpc::experimental::ServerInterceptorFactoryInterface>>;

/// The table outlives the server that they are for.
InterceptorFactories count_calls(ConnectionTable& connections);

}  // namespace ccslice::server
