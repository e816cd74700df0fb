// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What holds from request to request of one preview: the meshes, and what earlier requests have set.

#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "ccslice/v1/preview.pb.h"
#include "core/output/png.h"
#include "server/rpc/convert/convert_preview.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

inline double milliseconds_between(std::chrono::steady_clock::time_point from,
                                   std::chrono::steady_clock::time_point to) {
  return std::chrono::duration<double, std::milli>(to - from).count();
}

/// When a request arrived, when it was begun, and its picture.
struct PreviewTimes {
  std::chrono::steady_clock::time_point arrived, begun, painting;
};

/// One thread at a time.
class PreviewSession {
 public:
  /// Takes what the request sets for free planes, which are of the first of the call's meshes. Throws
  /// ServiceError{kRequestMalformed} if it names another mesh, and what to_placement() and to_printing() throw.
  void begin(const std::vector<MeshPtr>& meshes, const v1::PreviewRequest& request, const SliceLimits& limits);
  /// What it shows. Throws what to_preview() throws.
  PreviewWork work(const v1::PreviewRequest& request, const SliceLimits& limits, const CancellationToken& cancel) const;
  /// Equal for requests whose layers are of one job: these differ in their numbers only.
  std::string layers_key(const v1::PreviewRequest& request) const;
  /// The messages that bring the picture. Throws Error{kCancelled}.
  std::vector<v1::PreviewResponse> answer(const v1::PreviewRequest& request, v1::PreviewStage stage,
                                          const PreviewColours& show, const PreviewPicture& picture,
                                          const PreviewTimes& times, const CancellationToken& cancel);

 private:
  std::vector<std::shared_ptr<const LimitSolid>> solids_;  // Of the request's parts, or of its plane.
  Volumes volumes_;                                        // Those of the call.
  PreviewSetting setting_;
  PngEncoder png_;
};

}  // namespace ccslice::server
