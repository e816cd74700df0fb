// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/calls.h"

#include <atomic>
#include <exception>
#include <memory>

#include "server/rpc/calls/unary_call.h"
#include "server/rpc/convert/summary.h"

namespace ccslice::server {
namespace {

/// Answers at once if the cache holds the mesh. One that the store holds has to be prepared first, which ends when
/// nobody waits for it any more. It takes no place: preparations are few at the same time by themselves.
class GetMeshCall final : public UnaryCall {
 public:
  GetMeshCall(ServiceState& state, grpc::CallbackServerContext& context, v1::GetMeshResponse& response)
      : UnaryCall(state, context, "GetMesh"), response_(response) {}

  void begin(const grpc::ByteBuffer& raw) {
    const auto self = shared_from_this();
    if (const auto refused = open_call()) return end(*refused);
    v1::GetMeshRequest request;
    try {
      parse_and_drop(raw, request);
    } catch (...) {
      return end(to_status(std::current_exception()));
    }
    with_mesh(make_lane(Pieces::kInteractive), request.mesh_id(),
              [this](const MeshPtr& mesh, const std::exception_ptr& error) { summarize_mesh(mesh, error); });
    if (cancelled_) stop_loading();  // Cancelled before there was anything to stop.
  }

 private:
  bool is_limited() const override { return false; }

  void OnCancel() override {
    cancelled_ = true;
    stop_loading();
  }

  void summarize_mesh(const MeshPtr& mesh, const std::exception_ptr& error) {
    if (error) return end(cancelled_ ? status_of_stop() : to_status(error));
    *response_.mutable_mesh() = summarize(state_.cache, mesh);
    answer(grpc::Status::OK, response_.ByteSizeLong());
  }

  v1::GetMeshResponse& response_;
  std::atomic<bool> cancelled_{false};
};

}  // namespace

grpc::ServerUnaryReactor* begin_get_mesh_call(ServiceState& state, grpc::CallbackServerContext& context,
                                              const grpc::ByteBuffer& request, v1::GetMeshResponse& response) {
  const auto call = std::make_shared<GetMeshCall>(state, context, response);
  call->begin(request);
  return call.get();
}

}  // namespace ccslice::server
