// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "tests/server/test_server.h"

#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <stdexcept>

#include "google/rpc/error_details.pb.h"
#include "google/rpc/status.pb.h"
#include "server/service/meshes/mesh_id.h"
#include "tests/support/job_parts.h"

namespace ccslice::server {
namespace {

/// Each with a connection of its own: channels to the same address share one otherwise.
/// `grows`: how much it takes in unread follows from how fast it is.
std::shared_ptr<grpc::Channel> connect(const std::string& address, bool grows = true) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, grows ? 1 : 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

void collect(const v1::SliceRangeResponse& message, std::uint32_t& layer, Sliced& sliced) {
  switch (message.event_case()) {
    case v1::SliceRangeResponse::kHeader: sliced.header = message.header(); return;
    case v1::SliceRangeResponse::kSummary: sliced.summary = message.summary(); return;
    case v1::SliceRangeResponse::kLayerBegin:
      layer = message.layer_begin().layer();
      sliced.begins[layer] = message.layer_begin();
      sliced.planes[layer].resize(static_cast<std::size_t>(message.layer_begin().encoded_bytes_size()));
      break;
    case v1::SliceRangeResponse::kPlaneChunk: {
      std::string& plane = sliced.planes[layer].at(message.plane_chunk().plane());
      EXPECT_EQ(plane.size(), message.plane_chunk().offset());
      plane += message.plane_chunk().data();
      break;
    }
    case v1::SliceRangeResponse::kContourChunk:
      for (const auto& piece : message.contour_chunk().pieces()) {
        sliced.contour_points[layer] += static_cast<std::size_t>(piece.faces_size());
      }
      break;
    case v1::SliceRangeResponse::kLayerEnd: sliced.ends[layer] = message.layer_end(); break;
    default: ADD_FAILURE() << "an empty message";
  }
  sliced.layer_bytes[layer] += message.SerializeAsString();
}

}  // namespace

ServerOptions test_options() {
  ServerOptions options =
      parse_options({}, [](const std::string&) { return std::nullopt; }, {.cpus = 2, .memory_bytes = 1ull << 30})
          .options;
  options.listen_address = "127.0.0.1:0";
  return options;
}

Failure failure_of(const grpc::Status& status) {
  Failure failure;
  failure.code = status.error_code();
  failure.message = status.error_message();
  google::rpc::Status all;
  if (!all.ParseFromString(status.error_details())) return failure;
  for (const google::protobuf::Any& detail : all.details()) {
    google::rpc::ErrorInfo info;
    google::rpc::BadRequest bad_request;
    google::rpc::PreconditionFailure precondition;
    if (detail.UnpackTo(&info)) {
      failure.reason = info.reason();
      failure.domain = info.domain();
      const auto ids = info.metadata().find("ids");
      if (ids != info.metadata().end()) failure.ids = ids->second;
    } else if (detail.UnpackTo(&bad_request)) {
      failure.field = bad_request.field_violations(0).field();
    } else if (detail.UnpackTo(&precondition) && precondition.violations(0).type() == "MISSING") {
      failure.missing = precondition.violations(0).subject();
    }
    failure.retry = failure.retry || detail.Is<google::rpc::RetryInfo>();
  }
  return failure;
}

TestServer::TestServer(const ServerOptions& options)
    : server_(std::make_unique<Server>(options)),
      address_(server_->address()),
      channel_(connect(address_)),
      stub_(v1::SlicerService::NewStub(channel_)) {}

std::unique_ptr<v1::SlicerService::Stub> TestServer::new_stub() const {
  return v1::SlicerService::NewStub(connect(address_));
}

std::unique_ptr<v1::SlicerService::Stub> TestServer::new_narrow_stub() const {
  return v1::SlicerService::NewStub(connect(address_, /*grows=*/false));
}

grpc::Status TestServer::upload(const std::string& id, std::uint64_t size_bytes, const std::string& bytes,
                                v1::UploadMeshResponse* response, std::size_t chunk_bytes) {
  grpc::ClientContext context;
  v1::UploadMeshResponse ignored;
  const auto writer = stub_->UploadMesh(&context, response != nullptr ? response : &ignored);
  v1::UploadMeshRequest message;
  message.mutable_start()->set_mesh_id(id);
  message.mutable_start()->set_size_bytes(size_bytes);
  bool open = writer->Write(message);
  for (std::size_t offset = 0; open && offset < bytes.size(); offset += chunk_bytes) {
    message.set_chunk(bytes.substr(offset, chunk_bytes));
    open = writer->Write(message);
  }
  writer->WritesDone();
  return writer->Finish();
}

grpc::Status TestServer::upload(const v1::ControlMesh& mesh, v1::UploadMeshResponse* response) {
  const std::string bytes = mesh.SerializeAsString();
  return upload(mesh_id_of(bytes), bytes.size(), bytes, response);
}

std::string TestServer::upload_good(const v1::ControlMesh& mesh) {
  v1::UploadMeshResponse response;
  const grpc::Status status = upload(mesh, &response);
  if (!status.ok()) throw std::runtime_error("upload: " + status.error_message());
  return response.mesh().mesh_id();
}

Sliced TestServer::slice(const v1::SliceRangeRequest& request) {
  grpc::ClientContext context;
  Sliced sliced;
  const auto reader = stub_->SliceRange(&context, request);
  v1::SliceRangeResponse message;
  std::uint32_t layer = 0;
  while (reader->Read(&message)) {
    sliced.largest_message = std::max(sliced.largest_message, message.ByteSizeLong());
    collect(message, layer, sliced);
  }
  sliced.status = reader->Finish();
  return sliced;
}

v1::SliceRangeRequest slice_request(const std::string& mesh_id, double pitch_mm, std::uint32_t first,
                                    std::uint32_t count) {
  v1::SliceRangeRequest request;
  part_of(*request.mutable_job()).set_mesh_id(mesh_id);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_x_mm(pitch_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_y_mm(pitch_mm);
  request.mutable_job()->mutable_grid()->mutable_pitch()->set_z_mm(pitch_mm);
  request.set_first_layer(first);
  request.set_layer_count(count);
  request.mutable_job()->add_planes()->mutable_occupancy();
  return request;
}

std::string repeated(std::string_view bytes, std::size_t count) {
  std::string result;
  for (std::size_t i = 0; i < count; ++i) result += bytes;
  return result;
}

std::size_t resident_bytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t pages = 0;
  std::size_t resident = 0;
  file >> pages >> resident;
  return resident * 4096;
}

}  // namespace ccslice::server
