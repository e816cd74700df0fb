// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a call's mesh, within the memory that the server has for slicing.

#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/cancellation.h"
#include "core/preview/layer_painter.h"
#include "core/preview/plane_painter.h"
#include "server/rpc/convert_preview.h"
#include "server/service/memory_budget.h"
#include "server/service/mesh_cache.h"

namespace ccslice::server {

/// One thread at a time. What planes of one orientation and layers of one job share is kept from picture to picture.
/// paint() throws ServiceError{kServerBusy} where there is no memory, and what the painters of the core throw.
class PreviewPainter {
 public:
  PreviewPainter(MeshPtr mesh, MemoryBudget& scratch);

  PreviewPicture paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel);
  /// `key`: equal for requests whose layers are of one job.
  PreviewPicture paint(const LayerPreview& preview, const std::string& key, const CancellationToken& cancel);

 private:
  void reserve(const SliceJob& layer, const CancellationToken& cancel);

  MeshPtr mesh_;
  PlanePainter planes_;
  std::optional<LayerPainter> layers_;
  std::string layers_key_;
  std::uint64_t solid_bytes_ = 0, reserved_bytes_ = 0;
  MemoryBudget::Share share_;
};

}  // namespace ccslice::server
