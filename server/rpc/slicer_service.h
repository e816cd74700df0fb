// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccslice.v1.SlicerService over gRPC's callback API. Methods convert, call, stream: unary ones that only look something
// up answer at once, everything that computes does so on the workers. Requests come as bytes (raw_request.h), answers
// go as messages: the generated classes have either for both, so the handlers are put in place here.

#pragma once

#include "ccslice/v1/service.grpc.pb.h"
#include "server/rpc/service_state.h"

namespace ccslice::server {

class SlicerService final : public v1::SlicerService::Service {
 public:
  /// The state outlives the service.
  explicit SlicerService(ServiceState& state);

 private:
  template <class Request, class Response>
  void serve_unary(int method, void (SlicerService::*answer)(const Request&, Response&));

  void get_server_info(const v1::GetServerInfoRequest& request, v1::GetServerInfoResponse& response);
  void find_missing_meshes(const v1::FindMissingMeshesRequest& request, v1::FindMissingMeshesResponse& response);
  void get_mesh(const v1::GetMeshRequest& request, v1::GetMeshResponse& response);
  void list_meshes(const v1::ListMeshesRequest& request, v1::ListMeshesResponse& response);
  void delete_mesh(const v1::DeleteMeshRequest& request, v1::DeleteMeshResponse& response);

  ServiceState& state_;
};

}  // namespace ccslice::server
