// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Requests of previews: messages -> jobs of the core, and pictures -> messages. Pure.

#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <variant>
#include <vector>

#include "ccslice/v1/preview.pb.h"
#include "core/base/cancellation.h"
#include "core/job/placed_part.h"
#include "core/job/slice_limits.h"
#include "core/limit/limit_solid.h"
#include "core/preview/preview_job.h"
#include "server/service/meshes/mesh_cache.h"

namespace ccslice::server {

/// What holds of free planes, from message to message of a call.
struct PreviewSetting {
  Placement placement = Placement::Identity();
  std::shared_ptr<const Printing> printing;
};

/// A layer of a job to be shown, as core/preview/layer_painter.h makes it.
struct LayerPreview {
  PlacedParts parts;
  PreviewColours show;
  std::uint32_t layer = 0;
};

using PreviewWork = std::variant<PreviewJob, LayerPreview>;

/// What the request shows, valid for the solids and within the limits. `solids`: that of a free plane, or those of the
/// parts of a layer's job; `volumes`: those that fields name. Throws Error (2xx), ServiceError{kRequestMalformed,
/// kPrinterUnknown, kPrinterInvalid}.
PreviewWork to_preview(const v1::PreviewRequest& request, const PreviewSetting& setting,
                       std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                       const CancellationToken& cancel, const Volumes& volumes = {});

/// All but the times and the bytes of the encoded picture.
v1::PreviewHeader to_header(const PreviewPicture& picture, const PreviewColours& show);

/// The header, whose picture_bytes are set here, and the encoded picture: what PreviewResponse says of its parts, but
/// for numbers and stages, and which is the last.
std::vector<v1::PreviewResponse> to_parts(v1::PreviewHeader header, std::span<const std::uint8_t> picture);

/// Adds parts with the outlines.
void add_outlines(std::span<const std::vector<Vec2>> outlines, std::vector<v1::PreviewResponse>& parts);

}  // namespace ccslice::server
