// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/caller.h"

#include <grpcpp/security/auth_context.h>

#include <memory>
#include <string>

#include "server/service/base/logging.h"
#include "server/service/base/service_error.h"
#include "server/service/network/client_id.h"

namespace ccslice::server {
namespace {

/// The name that the client's certificate gives; empty without one.
std::string certificate_name(const grpc::CallbackServerContext& context) {
  const std::shared_ptr<const grpc::AuthContext> auth = context.auth_context();
  if (!auth || !auth->IsPeerAuthenticated()) return "";
  for (const char* property : {"x509_common_name", "x509_subject_alternative_name"}) {
    for (const grpc::string_ref& value : auth->FindPropertyValues(property)) {
      if (!value.empty()) return {value.data(), value.size()};
    }
  }
  return "";
}

Credentials credentials_of(const grpc::CallbackServerContext& context) {
  Credentials credentials{
      .authorization = {}, .certificate = certificate_name(context), .address = client_of(context.peer())};
  const auto header = context.client_metadata().find("authorization");
  if (header != context.client_metadata().end()) {
    credentials.authorization = std::string(header->second.data(), header->second.size());
  }
  return credentials;
}

}  // namespace

Role role_for(std::string_view method) {
  if (method == "UploadMesh") return Role::kWrite;
  if (method == "ListMeshes" || method == "DeleteMesh") return Role::kAdmin;
  return Role::kRead;
}

Caller caller_of(const Access& access, const grpc::CallbackServerContext& context, std::string_view method) {
  Caller caller;
  caller.credentials = credentials_of(context);
  caller.identity.client = caller.credentials.address;
  try {
    caller.identity = access.identify(caller.credentials);
    access.require(caller.identity, role_for(method));
  } catch (const ServiceError& error) {
    caller.refusal = std::current_exception();
    log_audit("refused",
              std::string(method) + " of " + caller.identity.client + ": " + std::string(reason(error.code())),
              {{"method", std::string(method)},
               {"client", caller.identity.client},
               {"peer", context.peer()},
               {"reason", std::string(reason(error.code()))}});
  }
  return caller;
}

std::exception_ptr refusal_by_now(const Access& access, const Caller& caller, std::string_view method) {
  if (access.is_open()) return nullptr;
  try {
    access.require(access.identify(caller.credentials), role_for(method));
    return nullptr;
  } catch (const ServiceError& error) {
    log_audit("ended", std::string(method) + " of " + caller.identity.client + ": " + std::string(reason(error.code())),
              {{"method", std::string(method)},
               {"client", caller.identity.client},
               {"reason", std::string(reason(error.code()))}});
    return std::current_exception();
  }
}

}  // namespace ccslice::server
