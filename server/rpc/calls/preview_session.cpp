// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_session.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/convert_printing.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

void PreviewSession::begin(const std::vector<MeshPtr>& meshes, const v1::PreviewRequest& request,
                           const SliceLimits& limits) {
  solids_.clear();
  volumes_ = volumes_of(meshes);
  const auto add = [&](std::span<const MeshPtr> among, const std::string& id, const std::string& field) {
    const auto mesh = std::ranges::find(among, id, &CachedMesh::id);
    if (mesh == among.end()) {
      throw ServiceError(ServiceErrorCode::kRequestMalformed,
                         field + ": changes within the call; make another call for another mesh", field);
    }
    solids_.push_back((*mesh)->solid(field));
  };
  if (request.plane().has_layer()) {
    const v1::SliceJob& job = request.plane().layer().job();
    for (int p = 0; p < job.parts_size(); ++p) {
      add(meshes, job.parts(p).mesh_id(), std::string(kLayerJobPath) + "." + path_of_part(p) + ".mesh_id");
    }
  } else {
    const std::string& first = meshes.front()->id();
    add(std::span(meshes).first(1), request.mesh_id().empty() ? first : request.mesh_id(), "mesh_id");
  }
  const SolidSummary& solid = meshes.front()->solid()->summary();
  if (request.has_placement()) {
    setting_.placement = to_placement(request.placement(), solid.bounding_box, limits);
  }
  if (request.has_printing()) {
    setting_.printing = std::make_shared<const Printing>(to_printing(request.printing(), solid));
  }
}

PreviewWork PreviewSession::work(const v1::PreviewRequest& request, const SliceLimits& limits,
                                 const CancellationToken& cancel) const {
  return to_preview(request, setting_, solids_, limits, cancel, volumes_);
}

std::string PreviewSession::layers_key(const v1::PreviewRequest& request) const {
  v1::PreviewLayer layer = request.plane().layer();
  if (!layer.job().has_region()) layer.clear_layer();  // A region of one layer is a job of its own.
  return layer.SerializeAsString() + '\n' + request.content().SerializeAsString() + (request.contours() ? "c" : "");
}

std::vector<v1::PreviewResponse> PreviewSession::answer(const v1::PreviewRequest& request, v1::PreviewStage stage,
                                                        const PreviewColours& show, const PreviewPicture& picture,
                                                        const PreviewTimes& times, const CancellationToken& cancel) {
  std::vector<std::uint8_t> encoded;
  std::span<const std::uint8_t> bytes = picture.rgba;
  if (request.encoding() != v1::PREVIEW_ENCODING_RGBA) {
    encoded = png_.colours(picture.columns, picture.rows, picture.rgba, cancel);
    bytes = encoded;
  }
  v1::PreviewHeader header = to_header(picture, show);
  header.set_queued_ms(milliseconds_between(times.arrived, times.begun));
  header.set_worked_ms(milliseconds_between(times.painting, std::chrono::steady_clock::now()));
  std::vector<v1::PreviewResponse> parts = to_parts(std::move(header), bytes);
  if (request.contours()) add_outlines(picture.outlines, parts);
  parts.back().set_last(true);
  for (v1::PreviewResponse& part : parts) {
    part.set_number(request.number());
    part.set_stage(stage);
  }
  return parts;
}

}  // namespace ccslice::server
