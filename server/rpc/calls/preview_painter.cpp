// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/calls/preview_painter.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/slicer/slicer_memory.h"
#include "server/rpc/convert/job_field.h"
#include "server/service/base/limits.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {

PreviewPainter::PreviewPainter(MeshPtr mesh, MemoryBudget& scratch, std::function<bool()> is_crowded)
    : mesh_(std::move(mesh)),
      scratch_(scratch),
      is_crowded_(std::move(is_crowded)),
      planes_(mesh_->solid()),
      share_(scratch) {}

bool PreviewPainter::reserve(std::uint64_t bytes) noexcept {
  const std::uint64_t all = scratch_.capacity_bytes();
  return share_.resize(bytes, is_short(bytes) ? 0 : std::min(scratch_for_short(all), all - bytes));
}

bool PreviewPainter::is_short(std::uint64_t bytes) const noexcept {
  return bytes <= scratch_for_short(scratch_.capacity_bytes());
}

PreviewPicture PreviewPainter::paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel) {
  SliceJob layer;
  layer.placement = under_plane(job.plane, job.placement);
  layer.grid = grid_of(job.plane);
  require_memory(layer, cancel);
  return planes_.paint(job, stage, cancel);
}

PreviewPicture PreviewPainter::paint(const LayerPreview& preview, const std::string& key,
                                     const CancellationToken& cancel) {
  if (!layers_ || key != layers_key_) {
    layers_.reset();
    require_memory(preview.job, cancel);
    layers_.emplace(mesh_->solid(), preview.job, preview.show, cancel);
    layers_key_ = key;
  }
  return at_job(kLayerJobPath, [&] { return layers_->paint(preview.layer, cancel); });
}

/// What a picture takes to cut the solid is about the same wherever its plane lies, so it is estimated once; what its
/// pixels take is added for each picture.
void PreviewPainter::require_memory(const SliceJob& layer, const CancellationToken& cancel) {
  constexpr std::uint64_t kBytesAPixel = 24;
  if (solid_bytes_ == 0) {
    const SlicerMemory memory = slicer_memory(mesh_->solid(), layer, cancel);
    solid_bytes_ = memory.shared_bytes + memory.slicer_bytes;
  }
  const LayerWindow window = region_of(layer).window();
  const std::uint64_t pixels = std::uint64_t{window.columns} * window.rows;
  const std::uint64_t wanted = solid_bytes_ + kBytesAPixel * pixels;
  if (wanted <= share_.bytes()) return;
  if (wanted > scratch_.capacity_bytes()) {
    const std::string remedy =
        solid_bytes_ < scratch_.capacity_bytes() ? "ask for a smaller one" : "use a larger server";
    throw job_exceeds_memory(
        "a picture of " + std::to_string(window.columns) + " x " + std::to_string(window.rows) + " pixels", wanted,
        scratch_.capacity_bytes(), remedy, "--scratch-budget-bytes");
  }
  if (is_crowded_() || !reserve(wanted)) throw PreviewMemoryMissing{wanted};
}

}  // namespace ccslice::server
