// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Who makes a call, and whether he may.

#pragma once

#include <grpcpp/server_context.h>

#include <exception>
#include <string_view>

#include "server/service/network/access.h"

namespace ccslice::server {

struct Caller {
  Credentials credentials;
  Identity identity;
  std::exception_ptr refusal;  // Why it may not.
};

/// By his token, else by his certificate, else by his address. Refusals go to the log.
[[nodiscard]] Caller caller_of(const Access& access, const grpc::CallbackServerContext& context,
                               std::string_view method);

/// Why the client may not make the call any more; null if it may.
[[nodiscard]] std::exception_ptr refusal_by_now(const Access& access, const Caller& caller, std::string_view method);

/// What a method takes. REQUIRES: a method of SlicerService.
[[nodiscard]] Role role_for(std::string_view method);

}  // namespace ccslice::server
