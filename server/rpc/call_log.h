// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One line in the log for every call, when it ends: method, peer, status, reason, time taken.

#pragma once

#include <grpcpp/server_context.h>
#include <grpcpp/support/status.h>

#include <chrono>
#include <string>

namespace ccslice::server {

/// `method` is a literal.
class CallLog {
 public:
  CallLog(const grpc::CallbackServerContext& context, const char* method)
      : method_(method), peer_(context.peer()), start_(std::chrono::steady_clock::now()) {}

  /// Something to remember about the call, such as its mesh.
  void note(const std::string& text) { notes_ += " " + text; }
  /// Failures that are the server's own are errors; everything else is information.
  void finish(const grpc::Status& status) const;

  std::chrono::nanoseconds elapsed() const { return std::chrono::steady_clock::now() - start_; }

 private:
  const char* method_;
  std::string peer_;
  std::chrono::steady_clock::time_point start_;
  std::string notes_;
};

/// Whether the deadline of a call has passed.
bool deadline_passed(const grpc::CallbackServerContext& context);

}  // namespace ccslice::server
