// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/server/slicer_service.h"

#include <array>
#include <chrono>
#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/engine_version.h"
#include "core/base/version.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/validate.h"
#include "core/output/encodings.h"
#include "server/rpc/calls/calls.h"
#include "server/rpc/calls/raw_request.h"
#include "server/rpc/calls/requests.h"
#include "server/rpc/calls/unary_call.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/printer.h"
#include "server/rpc/convert/status.h"
#include "server/rpc/convert/summary.h"

namespace ccslice::server {
namespace {

using grpc::ByteBuffer;
using grpc::CallbackServerContext;
using grpc::ServerUnaryReactor;
using grpc::internal::CallbackBidiHandler;
using grpc::internal::CallbackClientStreamingHandler;
using grpc::internal::CallbackServerStreamingHandler;
using grpc::internal::CallbackUnaryHandler;

/// By these numbers the generated class knows the methods: as the contract lists them.
enum Method : int {
  kGetServerInfo,
  kFindMissingMeshes,
  kUploadMesh,
  kGetMesh,
  kListMeshes,
  kDeleteMesh,
  kPlanSlices,
  kSliceRange,
  kProbePoints,
  kEvaluatePoints,
  kTessellateBoundary,
  kPreview,
  kGetPreparation
};
constexpr std::array kNames = {"GetServerInfo", "FindMissingMeshes", "UploadMesh",         "GetMesh",
                               "ListMeshes",    "DeleteMesh",        "PlanSlices",         "SliceRange",
                               "ProbePoints",   "EvaluatePoints",    "TessellateBoundary", "Preview",
                               "GetPreparation"};

/// A call that only looks something up.
class LookUpCall final : public UnaryCall {
 public:
  LookUpCall(ServiceState& state, CallbackServerContext& context, const char* method,
             const google::protobuf::Message& response)
      : UnaryCall(state, context, method), response_(response) {}

  using UnaryCall::parse_and_drop;

  /// `look_up` is given what ends the call, on any thread, and who makes it. May throw.
  template <class LookUp>
  void begin(LookUp&& look_up) {
    const auto self = shared_from_this();
    if (const auto refused = open_call()) return end(*refused);
    const auto answered = [this, self](const std::exception_ptr& error) {
      answer(error ? to_status(error) : grpc::Status::OK, response_.ByteSizeLong());
    };
    try {
      look_up(answered, client_);
    } catch (...) {
      answered(std::current_exception());
    }
  }

 private:
  bool is_limited() const override { return false; }

  const google::protobuf::Message& response_;
};

void write_limits(const ServiceState& state, v1::GetServerInfoResponse& info) {
  v1::MeshLimits& mesh = *info.mutable_mesh_limits();
  mesh.set_max_vertices(state.mesh_limits.max_vertices);
  mesh.set_max_cells(state.mesh_limits.max_cells);
  mesh.set_max_channels(static_cast<std::uint32_t>(state.mesh_limits.max_channels));
  mesh.set_max_channel_name_bytes(static_cast<std::uint32_t>(state.mesh_limits.max_channel_name_bytes));
  mesh.set_max_cell_regions(static_cast<std::uint32_t>(state.mesh_limits.max_cell_regions));
  mesh.set_max_cell_region_name_bytes(static_cast<std::uint32_t>(state.mesh_limits.max_cell_region_name_bytes));
  mesh.set_max_abs_coordinate_mm(state.mesh_limits.max_abs_coordinate_mm);
  mesh.set_max_edge_valence(state.mesh_limits.max_edge_valence);
  mesh.set_max_vertex_valence(state.mesh_limits.max_vertex_valence);
  v1::SliceLimits& slice = *info.mutable_slice_limits();
  slice.set_max_columns(state.slice_limits.max_columns);
  slice.set_max_rows(state.slice_limits.max_rows);
  slice.set_max_layers(state.slice_limits.max_layers);
  slice.set_max_voxels_per_layer(state.slice_limits.max_voxels_per_layer);
  slice.set_max_layer_bytes(state.slice_limits.max_layer_bytes);
  slice.set_min_pitch_mm(state.slice_limits.min_pitch_mm);
  slice.set_max_pitch_mm(state.slice_limits.max_pitch_mm);
  slice.set_min_contour_tolerance_mm(state.slice_limits.min_contour_tolerance_mm);
  slice.set_max_contour_tolerance_mm(state.slice_limits.max_contour_tolerance_mm);
  slice.set_max_channel_tolerance(state.slice_limits.max_channel_tolerance);
  slice.set_max_abs_coordinate_mm(state.slice_limits.max_abs_coordinate_mm);
  slice.set_max_planes(state.slice_limits.max_planes);
  slice.set_min_placement_scale(state.slice_limits.min_placement_scale);
  slice.set_max_placement_scale(state.slice_limits.max_placement_scale);
}

void write_formats(v1::GetServerInfoResponse& info) {
  for (const CellKindTraits& kind : kCellKinds) info.add_cell_kinds(to_message(kind));
  for (const auto type : {v1::SAMPLE_TYPE_BIT, v1::SAMPLE_TYPE_UINT8, v1::SAMPLE_TYPE_UINT16, v1::SAMPLE_TYPE_FLOAT32,
                          v1::SAMPLE_TYPE_UINT2, v1::SAMPLE_TYPE_UINT4}) {
    info.add_sample_types(type);
  }
  for (const EncodingTraits& encoding : encodings()) {
    if (encoding.is_built()) info.add_encodings(to_message(encoding));
  }
}

void write_info(ServiceState& state, v1::GetServerInfoResponse& info) {
  info.set_server_version(kVersion);
  info.set_engine_version(std::string(kEngineVersion));
  write_limits(state, info);
  write_formats(info);
  for (const PrinterProfile& profile : printer_profiles()) *info.add_printer_profiles() = to_message(profile);
  info.set_max_mesh_bytes(state.options.max_mesh_bytes);
  info.set_max_chunk_bytes(kMaxChunkBytes);
  info.set_max_points_per_message(kMaxPointsPerMessage);
  info.set_max_triangles(state.max_triangles);
  info.set_max_concurrent_calls(static_cast<std::uint32_t>(state.options.max_concurrent_calls));
  info.set_threads(static_cast<std::uint32_t>(state.executor.threads()));
  const CacheUse use = state.cache.use();
  info.set_cache_capacity_bytes(use.capacity_bytes);
  info.set_cache_used_bytes(use.used_bytes);
  info.set_cached_meshes(use.meshes);
}

/// Of those that the cache doesn't hold.
std::vector<std::string> uncached(MeshCache& cache, const v1::FindMissingMeshesRequest& request) {
  if (request.mesh_ids_size() > static_cast<int>(kMaxIdsPerMessage)) {
    throw ServiceError(ServiceErrorCode::kBatchTooLarge,
                       "mesh_ids: " + std::to_string(request.mesh_ids_size()) + " ids in one call, the limit is " +
                           std::to_string(kMaxIdsPerMessage) + "; ask in several calls",
                       "mesh_ids");
  }
  std::vector<std::string> missing;
  for (int i = 0; i < request.mesh_ids_size(); ++i) {
    require_mesh_id(request.mesh_ids(i), "mesh_ids[" + std::to_string(i) + "]");
    if (!cache.find(request.mesh_ids(i))) missing.push_back(request.mesh_ids(i));
  }
  return missing;
}

void list_page(MeshCache& cache, const v1::ListMeshesRequest& request, v1::ListMeshesResponse& response) {
  if (request.page_size() > kMaxPageSize) {
    throw ServiceError(ServiceErrorCode::kPageInvalid,
                       "page_size: " + std::to_string(request.page_size()) + " is above the limit of " +
                           std::to_string(kMaxPageSize) + "; ask for several pages",
                       "page_size");
  }
  if (!request.page_token().empty() && !is_mesh_id(request.page_token())) {
    throw ServiceError(ServiceErrorCode::kPageInvalid,
                       "page_token: this call never gave that one; leave it empty to start over", "page_token");
  }
  const std::size_t page_size = request.page_size() == 0 ? kDefaultPageSize : request.page_size();
  std::size_t bytes = 0;
  for (const ListedMesh& listed : cache.list(request.page_token(), page_size + 1)) {
    v1::MeshSummary summary = summarize(listed);
    bytes += summary.ByteSizeLong();
    const auto listed_so_far = static_cast<std::size_t>(response.meshes_size());
    if (listed_so_far == page_size || (listed_so_far > 0 && bytes > kMaxPageBytes)) {
      response.set_next_page_token(response.meshes(response.meshes_size() - 1).mesh_id());
      return;
    }
    *response.add_meshes() = std::move(summary);
  }
}

}  // namespace

SlicerService::SlicerService(ServiceState& state) : state_(state) {
  serve_unary(kGetServerInfo, &SlicerService::get_server_info);
  serve_unary(kFindMissingMeshes, &SlicerService::find_missing_meshes);
  serve_unary(kGetPreparation, &SlicerService::get_preparation);
  serve_unary(kListMeshes, &SlicerService::list_meshes);
  serve_unary(kDeleteMesh, &SlicerService::delete_mesh);
  MarkMethodRawCallback(kUploadMesh, new CallbackClientStreamingHandler<ByteBuffer, v1::UploadMeshResponse>(
                                         [this](CallbackServerContext* context, v1::UploadMeshResponse* response) {
                                           return begin_upload_call(state_, *context, *response);
                                         }));
  MarkMethodRawCallback(
      kGetMesh, new CallbackUnaryHandler<ByteBuffer, v1::GetMeshResponse>(
                    [this](CallbackServerContext* context, const ByteBuffer* request, v1::GetMeshResponse* response) {
                      return begin_get_mesh_call(state_, *context, *request, *response);
                    }));
  MarkMethodRawCallback(kPlanSlices, new CallbackUnaryHandler<ByteBuffer, v1::PlanSlicesResponse>(
                                         [this](CallbackServerContext* context, const ByteBuffer* request,
                                                v1::PlanSlicesResponse* response) {
                                           return begin_plan_call(state_, *context, *request, *response);
                                         }));
  MarkMethodRawCallback(kSliceRange, new CallbackServerStreamingHandler<ByteBuffer, v1::SliceRangeResponse>(
                                         [this](CallbackServerContext* context, const ByteBuffer* request) {
                                           return begin_slice_call(state_, *context, *request);
                                         }));
  MarkMethodRawCallback(kTessellateBoundary,
                        new CallbackServerStreamingHandler<ByteBuffer, v1::TessellateBoundaryResponse>(
                            [this](CallbackServerContext* context, const ByteBuffer* request) {
                              return begin_tessellate_call(state_, *context, *request);
                            }));
  MarkMethodRawCallback(kProbePoints,
                        new CallbackBidiHandler<ByteBuffer, v1::ProbePointsResponse>(
                            [this](CallbackServerContext* context) { return begin_probe_call(state_, *context); }));
  MarkMethodRawCallback(kEvaluatePoints,
                        new CallbackBidiHandler<ByteBuffer, v1::EvaluatePointsResponse>(
                            [this](CallbackServerContext* context) { return begin_evaluate_call(state_, *context); }));
  MarkMethodRawCallback(kPreview,
                        new CallbackBidiHandler<ByteBuffer, v1::PreviewResponse>(
                            [this](CallbackServerContext* context) { return begin_preview_call(state_, *context); }));
}

template <class Request, class Response>
void SlicerService::serve_unary(int method,
                                void (SlicerService::*look_up)(const Request&, Response&, const Answered&)) {
  MarkMethodRawCallback(
      method, new CallbackUnaryHandler<ByteBuffer, Response>(
                  [this, method, look_up](CallbackServerContext* context, const ByteBuffer* bytes, Response* response) {
                    const auto call = std::make_shared<LookUpCall>(state_, *context,
                                                                   kNames[static_cast<std::size_t>(method)], *response);
                    call->begin([&](const auto& answered, const std::string& client) {
                      Request request;
                      call->parse_and_drop(*bytes, request);
                      (this->*look_up)(request, *response, {answered, client});
                    });
                    return call.get();
                  }));
}

void SlicerService::get_server_info(const v1::GetServerInfoRequest&, v1::GetServerInfoResponse& response,
                                    const Answered& answered) {
  write_info(state_, response);
  answered(nullptr);
}

void SlicerService::find_missing_meshes(const v1::FindMissingMeshesRequest& request,
                                        v1::FindMissingMeshesResponse& response, const Answered& answered) {
  std::vector<std::string> missing = uncached(state_.cache, request);
  if (!state_.store || missing.empty()) {
    response.mutable_missing_mesh_ids()->Assign(missing.begin(), missing.end());
    return answered(nullptr);
  }
  state_.store->find(missing, answered.client, [missing, &response, answered](const std::vector<bool>& held) {
    for (std::size_t i = 0; i < missing.size(); ++i) {
      if (held.empty() || !held[i]) response.add_missing_mesh_ids(missing[i]);
    }
    answered(nullptr);
  });
}

void SlicerService::get_preparation(const v1::GetPreparationRequest& request, v1::GetPreparationResponse& response,
                                    const Answered& answered) {
  require_mesh_id(request.mesh_id(), "mesh_id");
  response = preparation_of(state_.cache, request.mesh_id());
  answered(nullptr);
}

void SlicerService::list_meshes(const v1::ListMeshesRequest& request, v1::ListMeshesResponse& response,
                                const Answered& answered) {
  list_page(state_.cache, request, response);
  answered(nullptr);
}

/// Also where the store isn't there the mesh leaves the cache.
void SlicerService::delete_mesh(const v1::DeleteMeshRequest& request, v1::DeleteMeshResponse& response,
                                const Answered& answered) {
  require_mesh_id(request.mesh_id(), "mesh_id");
  const bool was_cached = state_.cache.erase(request.mesh_id());
  response.set_deleted(was_cached);
  log_audit("deleted", request.mesh_id() + " by " + answered.client,
            {{"mesh", request.mesh_id()}, {"client", answered.client}});
  if (!state_.store) return answered(nullptr);
  state_.store->erase(
      request.mesh_id(), answered.client, [was_cached, &response, answered](const std::optional<bool>& was_stored) {
        if (was_stored) {
          response.set_deleted(was_cached || *was_stored);
          return answered(nullptr);
        }
        answered(std::make_exception_ptr(ServiceError(
            ServiceErrorCode::kStoreUnavailable,
            "the mesh has left this server's cache, but the store that servers share can't be asked: try again later",
            std::chrono::seconds(5))));
      });
}

}  // namespace ccslice::server
