// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A call of SliceRange that is read when the test says so.

#pragma once

#include <grpcpp/client_context.h>

#include <memory>
#include <string>

#include "ccslice/v1/service.grpc.pb.h"

namespace ccslice::server {

struct RangeReader {
  grpc::ClientContext context;
  std::unique_ptr<v1::SlicerService::Stub> stub;
  std::unique_ptr<grpc::ClientReader<v1::SliceRangeResponse>> stream;
  std::string bytes;  // Of what was read, but for the summary, which has times.
  grpc::Status status;

  bool read() {
    v1::SliceRangeResponse message;
    if (!stream->Read(&message)) return false;
    if (!message.has_summary()) bytes += message.SerializeAsString();
    return true;
  }
  void read_all() {
    while (read()) {
    }
    status = stream->Finish();
  }
};

}  // namespace ccslice::server
