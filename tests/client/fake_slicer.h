// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A small SlicerService that misbehaves on demand, in this process. Its layers are made of a pattern, not of a solid.

#pragma once

#include <grpcpp/security/server_credentials.h>
#include <grpcpp/server.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <vector>

#include "ccslice/v1/service.grpc.pb.h"

namespace ccslice::client {

class FakeSlicer final : public v1::SlicerService::Service {
 public:
  /// What a call does just before the given layer. OK: goes on.
  using BeforeLayer = std::function<grpc::Status(std::uint32_t layer, grpc::ServerContext& context)>;

  explicit FakeSlicer(std::shared_ptr<grpc::ServerCredentials> credentials = grpc::InsecureServerCredentials());
  ~FakeSlicer() override;

  const std::string& address() const { return address_; }
  /// Ends the server: nobody listens at its address any more.
  void stop();

  // What to do wrong. Set between calls only.
  BeforeLayer before_layer;
  std::function<grpc::Status(const v1::ProbePointsRequest&)> before_probe;  // A batch.
  std::function<void(v1::SliceRangeResponse&)> tamper;                      // Sees every message before it is sent.
  std::function<void(google::protobuf::Message&)> tamper_answer;            // The same for all other calls.
  std::function<void(grpc::ServerContext& context)> at_begin;               // Of most calls.
  std::function<void(grpc::ServerContext& context)> before_upload_ends;
  /// What GetPreparation answers. None: an older server, which doesn't know it.
  std::function<grpc::Status(grpc::ServerContext& context, v1::GetPreparationResponse& response)> preparation;
  std::string engine_version = "engine-1";
  double pitch_drift_mm = 0;
  int pictures_of_a_preview = 1;
  std::vector<grpc::Status> upload_failures;  // Used up from the back, one an upload.

  // What has happened.
  std::set<std::string> meshes;
  std::vector<v1::SliceRangeRequest> slice_requests;
  int uploads = 0;
  int preparation_calls = 0;
  int info_calls = 0;
  int failing_info_calls = 0;
  std::vector<int> probed_points;  // Of each batch.
  /// Of each call, what came as metadata: "Method name=value"; those names alone that the client adds.
  std::vector<std::string> metadata() const;

  grpc::Status GetServerInfo(grpc::ServerContext* context, const v1::GetServerInfoRequest* request,
                             v1::GetServerInfoResponse* response) override;
  grpc::Status FindMissingMeshes(grpc::ServerContext* context, const v1::FindMissingMeshesRequest* request,
                                 v1::FindMissingMeshesResponse* response) override;
  grpc::Status UploadMesh(grpc::ServerContext* context, grpc::ServerReader<v1::UploadMeshRequest>* reader,
                          v1::UploadMeshResponse* response) override;
  grpc::Status GetPreparation(grpc::ServerContext* context, const v1::GetPreparationRequest* request,
                              v1::GetPreparationResponse* response) override;
  grpc::Status GetMesh(grpc::ServerContext* context, const v1::GetMeshRequest* request,
                       v1::GetMeshResponse* response) override;
  /// One page.
  grpc::Status ListMeshes(grpc::ServerContext* context, const v1::ListMeshesRequest* request,
                          v1::ListMeshesResponse* response) override;
  grpc::Status DeleteMesh(grpc::ServerContext* context, const v1::DeleteMeshRequest* request,
                          v1::DeleteMeshResponse* response) override;
  grpc::Status PlanSlices(grpc::ServerContext* context, const v1::PlanSlicesRequest* request,
                          v1::PlanSlicesResponse* response) override;
  grpc::Status SliceRange(grpc::ServerContext* context, const v1::SliceRangeRequest* request,
                          grpc::ServerWriter<v1::SliceRangeResponse>* writer) override;
  grpc::Status ProbePoints(grpc::ServerContext* context,
                           grpc::ServerReaderWriter<v1::ProbePointsResponse, v1::ProbePointsRequest>* stream) override;
  /// Pictures of one pixel.
  grpc::Status Preview(grpc::ServerContext* context,
                       grpc::ServerReaderWriter<v1::PreviewResponse, v1::PreviewRequest>* stream) override;

 private:
  /// Keeps the metadata of a call, which begins.
  void note(const std::string& method, grpc::ServerContext& context);
  grpc::Status answer(google::protobuf::Message& response) const;
  v1::Grid grid_of(const v1::GridSpec& spec) const;
  void send(v1::SliceRangeResponse message, grpc::ServerWriter<v1::SliceRangeResponse>& writer) const;
  void send_layer(std::uint32_t layer, const v1::SliceHeader& header,
                  grpc::ServerWriter<v1::SliceRangeResponse>& writer) const;

  mutable std::mutex mutex_;  // Calls of several streams come at once.
  std::vector<std::string> metadata_;
  std::unique_ptr<grpc::Server> server_;
  std::string address_;
};

/// A failure as ccslice reports it.
grpc::Status failure(grpc::StatusCode code, const std::string& reason, const std::string& message);
grpc::Status mesh_missing(const std::string& mesh_id);
/// SERVER_BUSY with a RetryInfo.
grpc::Status busy_for(std::int64_t seconds, std::int32_t nanos);

}  // namespace ccslice::client
