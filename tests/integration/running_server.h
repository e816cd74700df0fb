// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "ccslice/v1/service.grpc.pb.h"
#include "tests/client/process.h"

namespace ccslice::server {

/// ccsliced as a process on this machine, on a free port unless the options name one.
class RunningServer {
 public:
  /// Waits until it serves. Throws std::runtime_error with its log if it doesn't.
  explicit RunningServer(const std::vector<std::string>& options = {});

  const std::string& address() const { return address_; }
  v1::SlicerService::Stub& stub() { return *stub_; }
  void send_signal(int signal) const { process_->send_signal(signal); }
  client::ProcessResult wait() { return process_->wait(); }
  std::string log() const;
  /// Waits until the log has this text; whether it came.
  bool logs(const std::string& text, std::chrono::milliseconds limit) const;

  /// Its id.
  std::string upload(const v1::ControlMesh& mesh);

 private:
  client::TemporaryFolder folder_;
  std::unique_ptr<client::Process> process_;
  std::string address_;
  std::unique_ptr<v1::SlicerService::Stub> stub_;
};

/// Runs ccsliced to its end.
client::ProcessResult run_ccsliced(const std::vector<std::string>& options);

}  // namespace ccslice::server
