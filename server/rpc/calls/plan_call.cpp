// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/calls.h"

#include <atomic>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "server/rpc/calls/unary_call.h"
#include "server/rpc/calls/unknown_fields.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/rpc/convert/slice_job.h"

namespace ccslice::server {
namespace {

/// Plans on a worker. Planning takes milliseconds, up to a second for the largest meshes, and waiting for a worker may
/// take longer: a call that is cancelled while it waits isn't planned, and is answered at once.
class PlanCall final : public UnaryCall {
 public:
  PlanCall(ServiceState& state, grpc::CallbackServerContext& context, const grpc::ByteBuffer& request,
           v1::PlanSlicesResponse& response)
      : UnaryCall(state, context, "PlanSlices"), raw_(request), response_(response) {}

  void begin() {
    if (const auto refused = open_call()) return refuse(*refused);
    if (const auto refused = hold_request(raw_, *v1::PlanSlicesRequest::descriptor())) return refuse(*refused);
    when_admitted([this] {
      const Executor::Lane lane = make_lane(Pieces::kInteractive);
      lane.post([this, call = shared_from_this(), lane] {
        if (claim()) find_meshes_and_plan(lane);
      });
    });
  }

 private:
  void OnCancel() override {
    cancel_.cancel();
    stop_loading();
    const bool was_waiting = leave_queue();  // For the first time, or again: then nobody else ends it.
    if (claim() || was_waiting) end(status_of_stop());
  }

  void refuse(const grpc::Status& status) override {
    if (claim()) end(status);
  }

  /// Whether the caller is the one to end the call.
  bool claim() { return !claimed_.exchange(true); }

  /// While the meshes come nothing of the request is kept but its bytes, which are counted.
  void find_meshes_and_plan(const Executor::Lane& lane) {
    std::vector<std::string> mesh_ids;
    try {
      const v1::PlanSlicesRequest request = parse();
      require_known_fields(request);
      mesh_ids = mesh_ids_of(request.job(), kJobPath);
    } catch (...) {
      return end(to_status(std::current_exception()));
    }
    with_meshes(
        lane, mesh_ids,
        [this](const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) { plan(meshes, error); },
        WhileMeshComes::kHasNoPlace);
    if (cancel_.cancelled()) stop_loading();
  }

  v1::PlanSlicesRequest parse() const {
    v1::PlanSlicesRequest request;
    parse_request(raw_, request);
    return request;
  }

  void plan(const std::vector<MeshPtr>& meshes, const std::exception_ptr& error) {
    grpc::Status status;
    try {
      if (error) std::rethrow_exception(error);
      log_.note_mesh(meshes.front()->id());
      const v1::PlanSlicesRequest request = parse();
      response_ = plan_slices(request, solids_of_parts(meshes, request.job().parts_size()), state_.slice_limits,
                              cancel_, volumes_of(meshes));
    } catch (...) {
      status = cancel_.cancelled() ? status_of_stop() : to_status(std::current_exception());
    }
    drop_request(raw_);  // The answer may wait for its reader.
    answer(status, response_.ByteSizeLong());
  }

  const grpc::ByteBuffer& raw_;
  v1::PlanSlicesResponse& response_;
  CancellationToken cancel_ = Executor::make_token();
  std::atomic<bool> claimed_{false};
};

}  // namespace

grpc::ServerUnaryReactor* begin_plan_call(ServiceState& state, grpc::CallbackServerContext& context,
                                          const grpc::ByteBuffer& request, v1::PlanSlicesResponse& response) {
  const auto call = std::make_shared<PlanCall>(state, context, request, response);
  call->begin();
  return call.get();
}

}  // namespace ccslice::server
