// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/calls.h"

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/base/number_text.h"
#include "core/channel/channel_values.h"
#include "core/field/point_probe.h"
#include "core/job/slice_job.h"
#include "core/limit/limit_evaluator.h"
#include "server/rpc/calls/batch_call.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/convert_fields.h"
#include "server/service/base/limits.h"

namespace ccslice::server {
namespace {

constexpr double kOnSurfaceMm = 1e-6;          // What inversion accepts,
constexpr double kRoundingOfDiagonal = 1e-12;  // and what doubles can't tell apart.
constexpr double kNearMm = 1e-3;               // Beyond the contours' tolerance: as far as SliceRange looks.

/// `numbers` of the batch make up `points` points.
void require_batch(int numbers, int points, const std::string& field) {
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

/// Holds until a message sets it anew.
struct ProbeSetting {
  Placement placement = Placement::Identity();
  std::shared_ptr<const Fields> fields;  // Null: none. Batches share them.
  Volumes volumes;                       // That they name.
  ChannelSources sources;                // Of the fields, in that place.
  double contour_tolerance_mm = SliceJob().contour_tolerance_mm;
};

/// Points are inverted as SliceRange inverts its voxels (point_probe.h), so that both give them the same values.
class ProbeSolver {
 public:
  using Request = v1::ProbePointsRequest;
  using Response = v1::ProbePointsResponse;
  using Setting = ProbeSetting;
  static constexpr std::uint64_t kBytes = 16 << 20;  // Patches, candidates, parts of cells.

  explicit ProbeSolver(MeshPtr mesh) : mesh_(std::move(mesh)) {}

  static std::size_t points(const Request& request) { return static_cast<std::size_t>(request.points_mm_size()) / 3; }
  static std::uint64_t answer_bytes(std::size_t points, std::size_t channels, const Setting& setting) {
    double of_sources = 0;
    for (const auto& source : setting.sources) of_sources += source->memory_bytes();
    return points * (3 * sizeof(std::int32_t) + (3 + channels + setting.sources.size() + 1) * sizeof(double)) +
           static_cast<std::uint64_t>(of_sources);
  }

  static std::vector<std::string> volume_ids(const Request& request) { return volume_ids_of(request.fields()); }
  static void accept(const Request& request, const std::shared_ptr<const LimitSolid>& solid, const Volumes& volumes,
                     const SliceLimits& limits, Setting& setting) {
    if (request.has_placement()) {
      setting.placement = to_placement(request.placement(), solid->summary().bounding_box, limits);
    }
    if (!request.fields().empty()) {
      setting.fields = std::make_shared<const Fields>(request.fields());
      setting.volumes = volumes;
    }
    if (setting.fields && (request.has_placement() || !request.fields().empty())) {
      const Box3 box = solid->summary().bounding_box.transformed(Placement(setting.placement));
      setting.sources = to_sources(*setting.fields, setting.volumes, solid, setting.placement.linear(), box);
    }
    if (!request.has_contour_tolerance_mm()) return;
    const double tolerance_mm = request.contour_tolerance_mm(), most_mm = limits.max_contour_tolerance_mm;
    if (!(tolerance_mm >= 0 && tolerance_mm <= most_mm)) {
      throw Error(ErrorCode::kToleranceInvalid,
                  "contour_tolerance_mm: " + number_text(tolerance_mm) + " is outside [0, " + number_text(most_mm) +
                      "]; give that of the SliceRange to compare with, or leave it out",
                  "contour_tolerance_mm");
    }
    setting.contour_tolerance_mm = tolerance_mm;
  }

  void answer(const Setting& setting, const Request& request, Response& response, const CancellationToken& cancel) {
    require_batch(request.points_mm_size(), request.points_mm_size() / 3, "points_mm");
    take_points(request);
    use(setting);
    const ChannelValues all(solid().summary().channels, setting.sources);
    const Placement mesh_of_world = setting.placement.inverse(Eigen::Affine);
    const std::size_t channels = all.channels().size();
    const auto points = static_cast<int>(points_.size());
    response.mutable_locations()->Resize(points, v1::POINT_LOCATION_OUTSIDE);
    response.mutable_limit_cells()->Resize(points, 0);
    response.mutable_control_cells()->Resize(points, 0);
    response.mutable_uvw()->Resize(3 * points, 0);
    response.mutable_channel_values()->Resize(static_cast<int>(channels) * points, 0);
    response.mutable_residuals_mm()->Resize(points, 0);
    const auto on_found = [&](std::size_t point, const ProbedPoint& found) {
      set(static_cast<int>(point), found, response);
      const std::span<double> values(response.mutable_channel_values()->mutable_data() + point * channels, channels);
      std::ranges::copy(found.channels, values.begin());
      all.complete(points_[point], mesh_of_world * points_[point], values);
    };
    probe_->probe(points_, on_found, cancel);
  }

 private:
  const LimitSolid& solid() const { return *mesh_->solid(); }

  void take_points(const Request& request) {
    points_.clear();
    for (int p = 0; p < request.points_mm_size() / 3; ++p) {
      const Vec3& point =
          points_.emplace_back(request.points_mm(3 * p), request.points_mm(3 * p + 1), request.points_mm(3 * p + 2));
      if (point.allFinite()) continue;
      const auto axis = std::find_if_not(point.begin(), point.end(), [](double x) { return std::isfinite(x); });
      const std::string field = "points_mm[" + std::to_string(3 * p + (axis - point.begin())) + "]";
      throw Error(ErrorCode::kPointNonFinite,
                  field + ": point " + std::to_string(p) + " is NaN or infinite; leave it out", field, {p});
    }
  }

  /// Clients may repeat a placement with every batch: what was made for it is worth keeping.
  void use(const Setting& setting) {
    const double tolerance_mm = setting.contour_tolerance_mm;
    if (probe_ && setting_.placement.matrix() == setting.placement.matrix() &&
        setting_.contour_tolerance_mm == tolerance_mm) {
      return;
    }
    const Vec3 scales = Eigen::JacobiSVD<Mat3>(setting.placement.linear()).singularValues();
    const double rounding_mm = kRoundingOfDiagonal * scales[0] * solid().summary().bounding_box.diagonal().norm();
    // Residuals are found in the mesh's frame, and told by the largest scale. A point within the tolerance may be off
    // by the tolerance over the smallest one there.
    inside_mm_ = (tolerance_mm + kOnSurfaceMm + rounding_mm) * scales[0] / scales[2];
    probe_.emplace(mesh_->solid(), setting.placement, tolerance_mm + kNearMm);
    setting_ = setting;
  }

  void set(int point, const ProbedPoint& found, Response& response) const {
    const bool inside = found.largest_residual_mm <= inside_mm_;
    response.set_locations(point, inside ? v1::POINT_LOCATION_INSIDE : v1::POINT_LOCATION_NEAR);
    response.set_limit_cells(point, found.at.cell);
    response.set_control_cells(point, solid().control_cell(found.at.cell));
    for (int axis = 0; axis < 3; ++axis) response.set_uvw(3 * point + axis, found.at.uvw[axis]);
    response.set_residuals_mm(point, found.residual_mm);
  }

  MeshPtr mesh_;
  std::vector<Vec3> points_;
  // For the setting at hand:
  Setting setting_;
  std::optional<PointProbe> probe_;
  double inside_mm_ = 0;  // Residuals of points that count as inside.
};

struct EvaluateSetting {
  Placement placement = Placement::Identity();
};

class EvaluateSolver {
 public:
  using Request = v1::EvaluatePointsRequest;
  using Response = v1::EvaluatePointsResponse;
  using Setting = EvaluateSetting;
  static constexpr std::uint64_t kBytes = 4 << 20;

  explicit EvaluateSolver(MeshPtr mesh)
      : mesh_(std::move(mesh)), evaluator_(*mesh_->solid()), values_(mesh_->solid()->channel_count()) {}

  static std::size_t points(const Request& request) { return static_cast<std::size_t>(request.limit_cells_size()); }
  static std::uint64_t answer_bytes(std::size_t points, std::size_t channels, const Setting&) {
    return points * (3 + channels + 9) * sizeof(double);
  }

  static std::vector<std::string> volume_ids(const Request&) { return {}; }
  static void accept(const Request& request, const std::shared_ptr<const LimitSolid>& solid, const Volumes&,
                     const SliceLimits& limits, Setting& setting) {
    if (!request.has_placement()) return;
    setting.placement = to_placement(request.placement(), solid->summary().bounding_box, limits);
  }

  void answer(const Setting& setting, const Request& request, Response& response, const CancellationToken& cancel) {
    require_batch(request.uvw_size(), request.limit_cells_size(), "uvw");
    response.mutable_positions_mm()->Reserve(3 * request.limit_cells_size());
    response.mutable_channel_values()->Reserve(static_cast<int>(values_.size()) * request.limit_cells_size());
    response.mutable_jacobians_mm()->Reserve(9 * request.limit_cells_size());
    for (int p = 0; p < request.limit_cells_size(); ++p) {
      cancel.throw_if_cancelled();
      evaluate(parameter(request, p), setting.placement, response);
    }
  }

 private:
  CellParam parameter(const Request& request, int p) const {
    const std::uint32_t cells = mesh_->solid()->cell_count(), cell = request.limit_cells(p);
    if (cell >= cells) {
      const std::string field = "limit_cells[" + std::to_string(p) + "]";
      throw Error(
          ErrorCode::kLimitCellUnknown,
          field + ": there is no limit cell " + std::to_string(cell) + "; the mesh has " + std::to_string(cells), field,
          {cell});
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

  void evaluate(const CellParam& at, const Placement& placement, Response& response) {
    const LimitSample sample = evaluator_.sample(at);
    const Vec3 position = placement * sample.position;
    const Mat3 jacobian = placement.linear() * sample.jacobian;
    evaluator_.mat(at, values_);
    for (int axis = 0; axis < 3; ++axis) response.add_positions_mm(position[axis]);
    response.mutable_channel_values()->Add(values_.begin(), values_.end());
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) response.add_jacobians_mm(jacobian(row, column));
    }
  }

  MeshPtr mesh_;
  LimitEvaluator evaluator_;
  std::vector<double> values_;
};

template <class Solver>
BatchCall<Solver>* begin_call(ServiceState& state, grpc::CallbackServerContext& context, const char* method) {
  const auto call = std::make_shared<BatchCall<Solver>>(state, context, method);
  call->begin();
  return call.get();
}

}  // namespace

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::ProbePointsResponse>* begin_probe_call(
    ServiceState& state, grpc::CallbackServerContext& context) {
  return begin_call<ProbeSolver>(state, context, "ProbePoints");
}

grpc::ServerBidiReactor<grpc::ByteBuffer, v1::EvaluatePointsResponse>* begin_evaluate_call(
    ServiceState& state, grpc::CallbackServerContext& context) {
  return begin_call<EvaluateSolver>(state, context, "EvaluatePoints");
}

}  // namespace ccslice::server
