// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/call_log.h"

#include <spdlog/spdlog.h>

#include <array>

#include "server/rpc/status.h"

namespace ccslice::server {
namespace {

/// Names by code, as gRPC's documentation has them.
constexpr std::array<const char*, 17> kCodeNames = {
    "OK",        "CANCELLED",      "UNKNOWN",           "INVALID_ARGUMENT",   "DEADLINE_EXCEEDED",
    "NOT_FOUND", "ALREADY_EXISTS", "PERMISSION_DENIED", "RESOURCE_EXHAUSTED", "FAILED_PRECONDITION",
    "ABORTED",   "OUT_OF_RANGE",   "UNIMPLEMENTED",     "INTERNAL",           "UNAVAILABLE",
    "DATA_LOSS", "UNAUTHENTICATED"};

const char* name_of(grpc::StatusCode code) {
  const auto index = static_cast<std::size_t>(code);
  return index < kCodeNames.size() ? kCodeNames[index] : "UNKNOWN";
}

}  // namespace

void CallLog::finish(const grpc::Status& status) const {
  const double ms = std::chrono::duration<double, std::milli>(elapsed()).count();
  if (status.ok()) {
    spdlog::info("{} from {}: OK in {:.1f} ms{}", method_, peer_, ms, notes_);
    return;
  }
  const auto level = status.error_code() == grpc::StatusCode::INTERNAL ? spdlog::level::err : spdlog::level::info;
  spdlog::log(level, "{} from {}: {} {} in {:.1f} ms{}: {}", method_, peer_, name_of(status.error_code()),
              reason_of(status), ms, notes_, status.error_message());
}

bool deadline_passed(const grpc::CallbackServerContext& context) {
  return std::chrono::system_clock::now() >= context.deadline();
}

}  // namespace ccslice::server
