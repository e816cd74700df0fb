// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One line in the log for every call, when it ends: method, peer, status, reason, time taken. The same goes to the
// metrics.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/service/base/logging.h"
#include "server/service/base/metrics.h"

namespace ccslice::server {

/// What calls wait for.
enum class Awaited { kPlace, kMemory };

/// Thread-safe. `method` is a literal.
class CallLog {
 public:
  /// Takes the trace and the request's id from the call's metadata, or makes an id; the client gets it back among the
  /// trailers, as x-request-id.
  CallLog(grpc::CallbackServerContext& context, const char* method, Metrics& metrics);

  const char* method() const noexcept { return method_; }
  /// By whom the call is made (access.h).
  void set_client(const std::string& client) { client_ = client; }
  /// Something to remember about the call.
  void note(const std::string& text);
  void note_mesh(const std::string& mesh_id);
  void note_layers(std::uint32_t first, std::uint32_t count);
  void add_bytes(std::uint64_t bytes);
  /// How long the call has waited, once more.
  void note_wait(Awaited awaited, std::chrono::nanoseconds waited);
  /// Failures that are the server's own are errors; everything else is information.
  void finish(const grpc::Status& status) const;

  std::chrono::nanoseconds elapsed() const { return std::chrono::steady_clock::now() - start_; }

 private:
  std::vector<LogField> fields_locked(const grpc::Status& status) const;

  const char* method_;
  Metrics& metrics_;
  std::string peer_, client_;
  std::chrono::steady_clock::time_point start_;
  std::string request_id_, trace_id_;
  mutable std::mutex mutex_;  // Guards what follows: a call that is cancelled ends on another thread.
  std::string notes_;
  std::vector<LogField> noted_;
  std::uint64_t bytes_ = 0;
  std::optional<std::chrono::nanoseconds> waited_;  // In all.
};

/// The trace-id of a W3C traceparent, the second part of "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01";
/// empty if it isn't one.
[[nodiscard]] std::string trace_id_of(std::string_view traceparent);

/// Whether the deadline of a call has passed.
bool deadline_passed(const grpc::CallbackServerContext& context);

}  // namespace ccslice::server
