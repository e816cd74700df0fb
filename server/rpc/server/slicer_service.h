// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccslice.v1.SlicerService over gRPC's callback API. Methods convert, call, stream: unary ones that only look something
// up answer at once, everything that computes does so on the workers. Requests come as bytes (raw_request.h), answers
// go as messages: the generated classes have either for both, so the handlers are put in place here.

#pragma once

#include <exception>
#include <functional>
#include <string>

#include "ccslice/v1/service.grpc.pb.h"
#include "server/rpc/calls/service_state.h"

namespace ccslice::server {

class SlicerService final : public v1::SlicerService::Service {
 public:
  /// The state outlives the service.
  explicit SlicerService(ServiceState& state);

 private:
  /// Ends a call, once: with why it fails, or with its response. Any thread.
  struct Answered {
    std::function<void(const std::exception_ptr& error)> end;
    std::string client;  // Who made the call.
    void operator()(const std::exception_ptr& error) const { end(error); }
  };

  template <class Request, class Response>
  void serve_unary(int method, void (SlicerService::*look_up)(const Request&, Response&, const Answered&));

  // Each ends the call, now or later. May throw instead.
  void get_server_info(const v1::GetServerInfoRequest& request, v1::GetServerInfoResponse& response,
                       const Answered& answered);
  void find_missing_meshes(const v1::FindMissingMeshesRequest& request, v1::FindMissingMeshesResponse& response,
                           const Answered& answered);
  void get_preparation(const v1::GetPreparationRequest& request, v1::GetPreparationResponse& response,
                       const Answered& answered);
  void list_meshes(const v1::ListMeshesRequest& request, v1::ListMeshesResponse& response, const Answered& answered);
  void delete_mesh(const v1::DeleteMeshRequest& request, v1::DeleteMeshResponse& response, const Answered& answered);

  ServiceState& state_;
};

}  // namespace ccslice::server
