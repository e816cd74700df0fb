// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/base/failure.h"

#include <algorithm>
#include <array>
#include <new>
#include <string_view>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/option_of_field.h"
#include "client/cli/base/text_values.h"
#include "client/client_error.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

ExitCode exit_code_of(const Error& error) {
  if (error.code() == ErrorCode::kFileUnwritable) return kExitOutput;
  const int number = static_cast<int>(error.code());
  const bool mesh = number >= 100 && number < 200, file = number >= 400;
  return mesh || file ? kExitInput : kExitBug;
}

/// Whether it is a fault of the command line alone, whatever the mesh and the server: wrong options exit alike, whoever
/// finds them.
bool is_wrong_option(std::string_view reason) {
  static constexpr auto kReasons =
      std::to_array<std::string_view>({"GRID_EXTENT_ZERO",      "GRID_ORIGIN_NON_FINITE", "MATERIAL_COLOUR_REPEATED",
                                       "MATERIAL_MAP_INVALID",  "MATERIAL_MAP_MISSING",   "MATERIAL_MAP_NON_FINITE",
                                       "MATERIAL_NAME_INVALID", "MATERIAL_NAME_REPEATED", "MATERIAL_UNKNOWN",
                                       "PICTURE_TOO_LARGE",     "PITCH_INVALID",          "PITCH_OUT_OF_RANGE",
                                       "PLACEMENT_NON_FINITE",  "PLANE_INVALID",          "PRINTER_UNKNOWN",
                                       "REGION_NON_FINITE",     "TOLERANCE_INVALID",      "TOO_MANY_MATERIALS",
                                       "VALUE_RANGE_INVALID",   "VALUE_RANGE_UNEXPECTED"});
  return std::ranges::find(kReasons, reason) != kReasons.end();
}

ExitCode exit_code_of(const client::ClientError& error) {
  if (error.reason() == client::local_reason::kCancelledHere) return kExitInterrupted;
  if (error.reason() == client::local_reason::kNotControlMesh) return kExitInput;
  if (error.reason() == client::local_reason::kCredentialsInvalid) return kExitInput;
  if (error.reason() == client::local_reason::kAddressInvalid) return kExitUsage;
  switch (error.code()) {
    case grpc::StatusCode::DATA_LOSS:
    case grpc::StatusCode::ABORTED: return kExitMismatch;
    case grpc::StatusCode::UNAVAILABLE:
    case grpc::StatusCode::DEADLINE_EXCEEDED:
    case grpc::StatusCode::CANCELLED: return kExitUnreachable;
    default: break;
  }
  if (is_wrong_option(error.reason())) return kExitUsage;
  const bool mesh_at_fault = error.code() == grpc::StatusCode::INVALID_ARGUMENT &&
                             error.reason().starts_with("MESH_") && error.reason() != "MESH_ID_INVALID";
  return mesh_at_fault ? kExitInput : kExitRefused;
}

std::string in_terms_of_user(const std::string& message, const std::string& job_file) {
  for (const std::string_view path : {"job.", "plane.layer.job."}) {
    if (!job_file.empty() && message.starts_with(path)) return job_file + ": " + message.substr(path.size());
  }
  return in_terms_of_options(message);
}

Failure failure_of_call(const client::ClientError& error, const std::string& job_file) {
  const std::string code = client::status_code_name(error.code());
  std::string message = echoed(in_terms_of_user(error.what(), job_file), kMaxMessageBytes);
  if (message.empty()) message = code;
  // Only the call's own deadline has no reason; gRPC says of it no more than that it has passed.
  if (error.code() == grpc::StatusCode::DEADLINE_EXCEEDED && error.reason().empty()) {
    message = "not done within the time of --timeout; give more seconds, or leave it out";
  }
  if (!error.missing_mesh_id().empty()) {
    message += job_file.empty() ? "; upload its file again, or name the file instead of the id"
                                : "; or name its file as MESH beside --job";
  }
  return {exit_code_of(error), error.reason().empty() ? code : echoed(error.reason()), message};
}

}  // namespace

Failure failure_of(const std::exception& exception, const std::string& job_file) {
  if (const auto* usage = dynamic_cast<const UsageError*>(&exception)) return {kExitUsage, "USAGE", usage->what()};
  if (const auto* call = dynamic_cast<const client::ClientError*>(&exception)) return failure_of_call(*call, job_file);
  if (const auto* error = dynamic_cast<const Error*>(&exception)) {
    return {exit_code_of(*error), std::string(reason(error->code())), error->what()};
  }
  if (dynamic_cast<const std::bad_alloc*>(&exception)) return {kExitInput, "OUT_OF_MEMORY", "not enough memory"};
  return {kExitBug, "INTERNAL", exception.what()};
}

void print_error_document(const Failure& failure) {
  v1::FailureDocument document;
  document.mutable_error()->set_exit_code(static_cast<std::uint32_t>(failure.exit_code));
  document.mutable_error()->set_reason(failure.reason);
  document.mutable_error()->set_message(failure.message);
  print_line(json_of(document));
}

void print_failure(const Failure& failure, bool json) {
  print_note("ccslice: " + failure.message);
  if (json) print_error_document(failure);
}

}  // namespace ccslice::cli
