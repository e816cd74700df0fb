// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Both calls work batch by batch: read, compute on a worker, write, read ... One of these is under way at any time, and
// its end decides what comes next, so no lock is needed and Finish is called exactly once. A read or a write that lasts
// too long is ended by the idle watch.

#include "server/rpc/point_call.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/number_text.h"
#include "core/field/material_field.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_evaluator.h"
#include "server/rpc/call.h"
#include "server/rpc/convert.h"
#include "server/rpc/unknown_fields.h"
#include "server/service/limits.h"

namespace ccslice::server {
namespace {

constexpr double kOnSurfaceMm = 1e-6;          // What inversion accepts,
constexpr double kRoundingOfDiagonal = 1e-12;  // and what doubles can't tell apart.
constexpr double kNearMm = 1e-3;               // Beyond the contours' tolerance: as far as SliceRange looks.

template <class Request, class Response>
class PointCall : public Call<grpc::ServerBidiReactor<grpc::ByteBuffer, Response>> {
  using Base = Call<grpc::ServerBidiReactor<grpc::ByteBuffer, Response>>;

 public:
  PointCall(ServiceState& state, grpc::CallbackServerContext& context, const char* method)
      : Base(state, context, method), lane_(this->make_lane(Pieces::kInteractive)) {}

  /// From here on the call keeps itself alive until gRPC is done with it.
  void begin() {
    if (const auto refused = this->open_call()) return end(*refused);
    this->watch();
    this->when_admitted([this] { read(); });
  }

 protected:
  using Base::end;
  using Base::log_;
  using Base::state_;

  /// Once, when the mesh is known.
  virtual void open(const LimitSolid& solid) = 0;
  /// Answers one batch. Throws Error, ServiceError.
  virtual void answer(const Request& request, Response& response) = 0;

  /// Before each point: hard ones take milliseconds.
  void poll() const { cancel_.throw_if_cancelled(); }

  /// `numbers` of the batch make up `points` points.
  void require_batch(int numbers, int points, const std::string& field) const {
    if (numbers != 3 * points) {
      throw ServiceError(ServiceErrorCode::kRequestMalformed,
                         field + " has " + std::to_string(numbers) + " numbers: give 3 per point", field);
    }
    if (points > static_cast<int>(kMaxPointsPerMessage)) {
      throw ServiceError(ServiceErrorCode::kBatchTooLarge,
                         field + ": " + std::to_string(points) + " points in one message, the limit is " +
                             std::to_string(kMaxPointsPerMessage) + "; send smaller batches",
                         field);
    }
  }

  const LimitSolid& solid() const { return *mesh_->solid(); }

  Placement placement_ = Placement::Identity();
  MeshPtr mesh_;

 private:
  void read() {
    this->wait_for_message([this] { this->StartRead(&raw_); });
  }

  void OnReadDone(bool ok) override {
    if (!this->end_wait()) return;
    if (!ok) return end(cancel_.cancelled() ? this->status_of_stop() : grpc::Status::OK);
    lane_.post([this, self = this->shared_from_this()] { compute(); });
  }
  void OnWriteDone(bool ok) override {
    if (!this->end_wait()) return;
    if (!ok) return end(this->status_of_stop());
    read();
  }
  void OnCancel() override {
    stop();
    this->end_if_waiting();
  }

  void stop() override {
    cancel_.cancel();
    this->stop_loading();
  }

  void compute() {
    try {
      cancel_.throw_if_cancelled();
      parse_request(raw_, request_);
      require_known_fields(request_);
    } catch (...) {
      return fail();
    }
    if (mesh_) return compute_answer();
    this->with_mesh(lane_, request_.mesh_id(), [this](const MeshPtr& mesh, const std::exception_ptr& error) {
      mesh_ = mesh;
      compute_answer(error);
    });
    if (cancel_.cancelled()) this->stop_loading();  // Cancelled before there was anything to stop.
  }

  void fail() { end(cancel_.cancelled() ? this->status_of_stop() : to_status(std::current_exception())); }

  void compute_answer(const std::exception_ptr& error = nullptr) {
    try {
      if (error) std::rethrow_exception(error);
      accept_header();
      response_.Clear();
      answer(request_, response_);
    } catch (...) {
      return fail();
    }
    this->wait_for_reader([this] { this->StartWrite(&response_); });
  }

  void accept_header() {
    if (!is_open_) {
      is_open_ = true;
      log_.note_mesh(mesh_->id());
      open(solid());
    } else if (!request_.mesh_id().empty() && request_.mesh_id() != mesh_->id()) {
      throw ServiceError(ServiceErrorCode::kRequestMalformed,
                         "mesh_id changes within the call: make another call for another mesh", "mesh_id");
    }
    if (request_.has_placement()) {
      placement_ = to_placement(request_.placement(), solid().summary().bounding_box, state_.slice_limits);
    }
  }

  bool is_open_ = false;
  Executor::Lane lane_;
  CancellationToken cancel_ = Executor::make_token();
  grpc::ByteBuffer raw_;
  Request request_;
  Response response_;
};

/// Points are inverted as SliceRange inverts its voxels (material_field.h), so that both give them the same materials.
class ProbeCall final : public PointCall<v1::ProbePointsRequest, v1::ProbePointsResponse> {
 public:
  ProbeCall(ServiceState& state, grpc::CallbackServerContext& context) : PointCall(state, context, "ProbePoints") {}

 private:
  void open(const LimitSolid& solid) override {
    evaluator_.emplace(solid);
    materials_.resize(solid.channel_count());
  }

  void answer(const v1::ProbePointsRequest& request, v1::ProbePointsResponse& response) override {
    const int points = request.points_mm_size() / 3;
    require_batch(request.points_mm_size(), points, "points_mm");
    accept_tolerance(request);
    prepare_field();
    for (int p = 0; p < points; ++p) {
      poll();
      const Vec3 point(request.points_mm(3 * p), request.points_mm(3 * p + 1), request.points_mm(3 * p + 2));
      if (!point.allFinite()) {
        const auto axis = std::find_if_not(point.begin(), point.end(), [](double x) { return std::isfinite(x); });
        const std::string field = "points_mm[" + std::to_string(3 * p + (axis - point.begin())) + "]";
        throw Error(ErrorCode::kPointNonFinite,
                    field + ": point " + std::to_string(p) + " is NaN or infinite; leave it out", field, {p});
      }
      probe(point, response);
    }
  }

  void accept_tolerance(const v1::ProbePointsRequest& request) {
    if (!request.has_contour_tolerance_mm()) return;
    const double tolerance_mm = request.contour_tolerance_mm(), most_mm = state_.slice_limits.max_contour_tolerance_mm;
    if (!(tolerance_mm >= 0 && tolerance_mm <= most_mm)) {
      throw Error(ErrorCode::kToleranceInvalid,
                  "contour_tolerance_mm: " + number_text(tolerance_mm) + " is outside [0, " + number_text(most_mm) +
                      "]; give that of the SliceRange to compare with, or leave it out",
                  "contour_tolerance_mm");
    }
    contour_tolerance_mm_ = tolerance_mm;
  }

  /// Clients may repeat a placement with every batch: what was kept for it is worth keeping.
  void prepare_field() {
    if (field_ && field_placement_.matrix() == placement_.matrix() && field_tolerance_mm_ == contour_tolerance_mm_) {
      return;
    }
    const Vec3 scales = Eigen::JacobiSVD<Mat3>(placement_.linear()).singularValues();
    const double rounding_mm = kRoundingOfDiagonal * scales[0] * solid().summary().bounding_box.diagonal().norm();
    // Residuals are found in the mesh's frame, and told by the largest scale. A point within the tolerance may be off
    // by the tolerance over the smallest one there.
    inside_mm_ = (contour_tolerance_mm_ + kOnSurfaceMm + rounding_mm) * scales[0] / scales[2];
    field_ = make_material_field(mesh_->solid(), placement_, contour_tolerance_mm_ + kNearMm);
    field_placement_ = placement_;
    field_tolerance_mm_ = contour_tolerance_mm_;
  }

  void probe(const Vec3& point, v1::ProbePointsResponse& response) {
    const auto found = field_->invert(point, hint_);
    std::fill(materials_.begin(), materials_.end(), 0.0);
    if (!found) return add(v1::POINT_LOCATION_OUTSIDE, CellParam{}, {}, 0, response);
    hint_ = found->at;
    field_->mat(found->at, materials_);
    const double residual_mm = (placement_ * evaluator_->geo(found->at) - point).norm();
    const bool inside = found->residual_mm <= inside_mm_;
    add(inside ? v1::POINT_LOCATION_INSIDE : v1::POINT_LOCATION_NEAR, found->at, solid().control_cell(found->at.cell),
        residual_mm, response);
  }

  void add(v1::PointLocation location, const CellParam& at, ControlCellId control_cell, double residual_mm,
           v1::ProbePointsResponse& response) {
    response.add_locations(location);
    response.add_limit_cells(at.cell);
    response.add_control_cells(control_cell);
    for (int axis = 0; axis < 3; ++axis) response.add_uvw(at.uvw[axis]);
    response.mutable_materials()->Add(materials_.begin(), materials_.end());
    response.add_residuals_mm(residual_mm);
  }

  double contour_tolerance_mm_ = SliceJob().contour_tolerance_mm;
  // For the placement and the tolerance at hand:
  std::unique_ptr<MaterialField> field_;
  Placement field_placement_ = Placement::Identity();
  double field_tolerance_mm_ = 0;
  double inside_mm_ = 0;  // Residuals of points that count as inside.

  std::optional<LimitEvaluator> evaluator_;
  std::optional<CellParam> hint_;
  std::vector<double> materials_;
};

class EvaluateCall final : public PointCall<v1::EvaluatePointsRequest, v1::EvaluatePointsResponse> {
 public:
  EvaluateCall(ServiceState& state, grpc::CallbackServerContext& context)
      : PointCall(state, context, "EvaluatePoints") {}

 private:
  void open(const LimitSolid& solid) override {
    evaluator_.emplace(solid);
    materials_.resize(solid.channel_count());
  }

  void answer(const v1::EvaluatePointsRequest& request, v1::EvaluatePointsResponse& response) override {
    require_batch(request.uvw_size(), request.limit_cells_size(), "uvw");
    for (int p = 0; p < request.limit_cells_size(); ++p) {
      poll();
      evaluate(parameter(request, p), response);
    }
  }

  CellParam parameter(const v1::EvaluatePointsRequest& request, int p) const {
    const std::uint32_t cell = request.limit_cells(p);
    if (cell >= solid().cell_count()) {
      const std::string field = "limit_cells[" + std::to_string(p) + "]";
      throw Error(ErrorCode::kLimitCellUnknown,
                  field + ": there is no limit cell " + std::to_string(cell) + "; the mesh has " +
                      std::to_string(solid().cell_count()),
                  field, {cell});
    }
    CellParam at{.cell = LimitCellId{cell},
                 .uvw = Vec3(request.uvw(3 * p), request.uvw(3 * p + 1), request.uvw(3 * p + 2))};
    const auto outside = std::find_if_not(at.uvw.begin(), at.uvw.end(), [](double x) { return x >= 0 && x <= 1; });
    if (outside != at.uvw.end()) {
      const std::string field = "uvw[" + std::to_string(3 * p + (outside - at.uvw.begin())) + "]";
      throw Error(ErrorCode::kParameterInvalid,
                  field + ": " + number_text(*outside) + " (point " + std::to_string(p) + ") isn't in [0,1]; clamp it",
                  field, {p});
    }
    return at;
  }

  void evaluate(const CellParam& at, v1::EvaluatePointsResponse& response) {
    const LimitSample sample = evaluator_->sample(at);
    const Vec3 position = placement_ * sample.position;
    const Mat3 jacobian = placement_.linear() * sample.jacobian;
    evaluator_->mat(at, materials_);
    for (int axis = 0; axis < 3; ++axis) response.add_positions_mm(position[axis]);
    response.mutable_materials()->Add(materials_.begin(), materials_.end());
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) response.add_jacobians_mm(jacobian(row, column));
    }
  }

  std::optional<LimitEvaluator> evaluator_;
  std::vector<double> materials_;
};

template <class AnyPointCall>
AnyPointCall* begin_call(ServiceState& state, grpc::CallbackServerContext& context) {
  const auto call = std::make_shared<AnyPointCall>(state, context);
  call->begin();
  return call.get();
}

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::ProbePointsResponse>* begin_probe_call(
    ServiceState& state, grpc::CallbackServerContext& context) {
  return begin_call<ProbeCall>(state, context);
}

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::EvaluatePointsResponse>* begin_evaluate_call(
    ServiceState& state, grpc::CallbackServerContext& context) {
  return begin_call<EvaluateCall>(state, context);
}

}  // namespace ccslice::server
