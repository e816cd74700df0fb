// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccslice.v1.SlicerService over gRPC's callback API. Methods convert, call, stream: unary ones that only look something
// up answer at once, everything that computes does so on the workers.

#pragma once

#include "ccslice/v1/service.grpc.pb.h"
#include "server/rpc/service_state.h"

namespace ccslice::server {

class SlicerService final : public v1::SlicerService::CallbackService {
 public:
  /// The state outlives the service.
  explicit SlicerService(ServiceState& state) : state_(state) {}

  grpc::ServerUnaryReactor* GetServerInfo(grpc::CallbackServerContext* context, const v1::GetServerInfoRequest* request,
                                          v1::GetServerInfoResponse* response) override;
  grpc::ServerUnaryReactor* FindMissingMeshes(grpc::CallbackServerContext* context,
                                              const v1::FindMissingMeshesRequest* request,
                                              v1::FindMissingMeshesResponse* response) override;
  grpc::ServerReadReactor<v1::UploadMeshRequest>* UploadMesh(grpc::CallbackServerContext* context,
                                                             v1::UploadMeshResponse* response) override;
  grpc::ServerUnaryReactor* GetMesh(grpc::CallbackServerContext* context, const v1::GetMeshRequest* request,
                                    v1::GetMeshResponse* response) override;
  grpc::ServerUnaryReactor* ListMeshes(grpc::CallbackServerContext* context, const v1::ListMeshesRequest* request,
                                       v1::ListMeshesResponse* response) override;
  grpc::ServerUnaryReactor* DeleteMesh(grpc::CallbackServerContext* context, const v1::DeleteMeshRequest* request,
                                       v1::DeleteMeshResponse* response) override;
  grpc::ServerUnaryReactor* PlanSlices(grpc::CallbackServerContext* context, const v1::PlanSlicesRequest* request,
                                       v1::PlanSlicesResponse* response) override;
  grpc::ServerWriteReactor<v1::SliceRangeResponse>* SliceRange(grpc::CallbackServerContext* context,
                                                               const v1::SliceRangeRequest* request) override;
  grpc::ServerBidiReactor<v1::ProbePointsRequest, v1::ProbePointsResponse>* ProbePoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerBidiReactor<v1::EvaluatePointsRequest, v1::EvaluatePointsResponse>* EvaluatePoints(
      grpc::CallbackServerContext* context) override;
  grpc::ServerWriteReactor<v1::TessellateBoundaryResponse>* TessellateBoundary(
      grpc::CallbackServerContext* context, const v1::TessellateBoundaryRequest* request) override;

 private:
  ServiceState& state_;
};

}  // namespace ccslice::server
