// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

//
// A real server on a free port of this machine, and a channel to it.

#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <chrono>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "ccslice/v1/service.grpc.pb.h"
#include "server/rpc/server/server.h"

namespace ccslice::server {

/// Two threads, little memory, port 0.
ServerOptions test_options();

/// A failed call as a client sees it.
struct Failure {
  grpc::StatusCode code = grpc::StatusCode::OK;
  std::string reason;   // ErrorInfo.reason.
  std::string domain;   // ErrorInfo.domain.
  std::string field;    // BadRequest.field_violations[0].field.
  std::string ids;      // ErrorInfo.metadata["ids"].
  std::string missing;  // PreconditionFailure of type MISSING: its subject.
  bool retry = false;   // With a RetryInfo.
  std::string message;
};
Failure failure_of(const grpc::Status& status);

/// An answer of SliceRange, whole.
struct Sliced {
  grpc::Status status;
  v1::SliceHeader header;
  std::map<std::uint32_t, std::string> layer_bytes;  // All messages of a layer, serialized one after the other.
  std::map<std::uint32_t, v1::LayerEnd> ends;
  std::map<std::uint32_t, std::vector<std::string>> planes;  // Encoded planes, put together.
  std::map<std::uint32_t, v1::LayerBegin> begins;
  std::map<std::uint32_t, std::size_t> contour_points;
  v1::SliceSummary summary;
  std::size_t largest_message = 0;
};

class TestServer {
 public:
  explicit TestServer(const ServerOptions& options = test_options());

  Server& server() { return *server_; }
  void stop() { server_.reset(); }
  v1::SlicerService::Stub& stub() { return *stub_; }
  const std::shared_ptr<grpc::Channel>& channel() { return channel_; }
  /// A stub over a connection of its own.
  std::unique_ptr<v1::SlicerService::Stub> new_stub() const;
  /// One whose connection takes in no more than 64 KiB of what isn't read.
  std::unique_ptr<v1::SlicerService::Stub> new_narrow_stub() const;

  /// Uploads these bytes under this id, saying that there are `size_bytes`, in chunks of `chunk_bytes`.
  grpc::Status upload(const std::string& id, std::uint64_t size_bytes, const std::string& bytes,
                      v1::UploadMeshResponse* response = nullptr, std::size_t chunk_bytes = 1 << 20);
  /// Uploads a mesh as a good client does; its status.
  grpc::Status upload(const v1::ControlMesh& mesh, v1::UploadMeshResponse* response = nullptr);
  /// Uploads a mesh that has to be fine; its id.
  std::string upload_good(const v1::ControlMesh& mesh);

  Sliced slice(const v1::SliceRangeRequest& request);
  Failure slice_failure(const v1::SliceRangeRequest& request) { return failure_of(slice(request).status); }

 private:
  std::unique_ptr<Server> server_;
  std::string address_;
  std::shared_ptr<grpc::Channel> channel_;
  std::unique_ptr<v1::SlicerService::Stub> stub_;
};

/// Occupancy of all layers at this pitch in all directions.
v1::SliceRangeRequest slice_request(const std::string& mesh_id, double pitch_mm, std::uint32_t first,
                                    std::uint32_t count);

/// So many times the same bytes.
std::string repeated(std::string_view bytes, std::size_t count);

/// Memory of this process.
std::size_t resident_bytes();

/// AddressSanitizer does so for a while: resident_bytes() says little then.
#ifdef __has_feature
inline constexpr bool kKeepsFreedMemory = __has_feature(address_sanitizer);
#else
inline constexpr bool kKeepsFreedMemory = false;
#endif

/// Waits until `condition` holds, but not longer than `limit`. Whether it holds.
template <class Condition>
bool eventually(Condition&& condition, std::chrono::milliseconds limit) {
  const auto end = std::chrono::steady_clock::now() + limit;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

}  // namespace ccslice::server
