// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/plan_call.h"

#include <atomic>
#include <memory>

#include "server/rpc/call_log.h"
#include "server/rpc/requests.h"
#include "server/rpc/slice_job.h"
#include "server/rpc/status.h"

namespace ccslice::server {
namespace {

/// Plans on a worker. Planning takes milliseconds, waiting for a worker may take longer: a call that was cancelled
/// meanwhile isn't planned, and is answered without waiting.
class PlanCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<PlanCall> {
 public:
  PlanCall(ServiceState& state, grpc::CallbackServerContext& context, const v1::PlanSlicesRequest& request,
           v1::PlanSlicesResponse& response)
      : state_(state), context_(context), request_(request), response_(response), log_(context, "PlanSlices") {}

  void begin() {
    self_ = shared_from_this();
    try {
      admission_ = state_.calls.admit([weak = weak_from_this()] {
        if (const auto open = weak.lock()) open->OnCancel();
      });
    } catch (...) {
      claim();
      return end(to_status(std::current_exception()));
    }
    state_.executor.make_lane().post([call = self_] {
      if (call->claim()) call->plan();
    });
  }

 private:
  void OnCancel() override {
    if (claim()) end(stopped_status(state_.calls.cutting_off(), deadline_passed(context_)));
  }
  void OnDone() override { const std::shared_ptr<PlanCall> last = std::move(self_); }

  /// Whether the caller is the one to end the call.
  bool claim() { return !claimed_.exchange(true); }

  void plan() {
    grpc::Status status;
    try {
      const MeshPtr mesh = require_mesh(state_, request_.mesh_id());
      response_ = plan_slices(request_, *mesh->solid(), state_.slice_limits);
    } catch (...) {
      status = to_status(std::current_exception());
    }
    end(status);
  }

  void end(const grpc::Status& status) {
    admission_.end_run();
    log_.finish(status);
    Finish(status);
  }

  ServiceState& state_;
  grpc::CallbackServerContext& context_;
  const v1::PlanSlicesRequest& request_;
  v1::PlanSlicesResponse& response_;
  CallLog log_;
  std::shared_ptr<PlanCall> self_;
  CallRegistry::Ticket admission_;
  std::atomic<bool> claimed_{false};
};

}  // namespace

grpc::ServerUnaryReactor* begin_plan_call(ServiceState& state, grpc::CallbackServerContext& context,
                                          const v1::PlanSlicesRequest& request, v1::PlanSlicesResponse& response) {
  const auto call = std::make_shared<PlanCall>(state, context, request, response);
  call->begin();
  return call.get();
}

}  // namespace ccslice::server
