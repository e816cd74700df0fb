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

namespace {

std::uint64_t bytes_of(const SlicerMemory& memory) { return memory.shared_bytes + memory.slicer_bytes; }

}  // namespace

PreviewPainter::PreviewPainter(std::vector<MeshPtr> meshes, MemoryBudget& scratch, std::function<bool()> is_crowded)
    : meshes_(std::move(meshes)),
      scratch_(scratch),
      is_crowded_(std::move(is_crowded)),
      planes_(meshes_.front()->solid()),
      share_(scratch) {}

bool PreviewPainter::reserve(std::uint64_t bytes) noexcept {
  const std::uint64_t all = scratch_.capacity_bytes();
  return share_.resize(bytes, is_short(bytes) ? 0 : std::min(scratch_for_short(all), all - bytes));
}

bool PreviewPainter::is_short(std::uint64_t bytes) const noexcept {
  return bytes <= scratch_for_short(scratch_.capacity_bytes());
}

/// What a picture takes to cut the solid is about the same wherever its plane lies, so it is estimated once.
PreviewPicture PreviewPainter::paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel) {
  SliceJob layer;
  layer.placement = under_plane(job.plane, job.placement);
  layer.grid = grid_of(job.plane);
  if (plane_bytes_ == 0) plane_bytes_ = bytes_of(slicer_memory(meshes_.front()->solid(), layer, cancel));
  require_memory(plane_bytes_, region_of(layer).window());
  return planes_.paint(job, stage, cancel);
}

PreviewPicture PreviewPainter::paint(const LayerPreview& preview, const std::string& key,
                                     const CancellationToken& cancel) {
  if (!layers_ || key != layers_key_) {
    layers_.reset();
    const SlicerMemory memory = slicer_memory(preview.parts, cancel);
    require_memory(bytes_of(memory), region_of(preview.parts.front().job).window());
    layers_.emplace(preview.parts, preview.show, cancel, memory.tiles_fit);
    layers_key_ = key;
  }
  return at_job(kLayerJobPath, [&] { return layers_->paint(preview.layer, cancel); });
}

/// `cut_bytes`: of all but the pixels, which `window` has.
void PreviewPainter::require_memory(std::uint64_t cut_bytes, const LayerWindow& window) {
  constexpr std::uint64_t kBytesAPixel = 24;
  const std::uint64_t pixels = std::uint64_t{window.columns} * window.rows;
  const std::uint64_t wanted = cut_bytes + kBytesAPixel * pixels;
  if (wanted <= share_.bytes()) return;
  if (wanted > scratch_.capacity_bytes()) {
    const std::string remedy = cut_bytes < scratch_.capacity_bytes() ? "ask for a smaller one" : "use a larger server";
    throw job_exceeds_memory(
        "a picture of " + std::to_string(window.columns) + " x " + std::to_string(window.rows) + " pixels", wanted,
        scratch_.capacity_bytes(), remedy, "--scratch-budget-bytes");
  }
  if (is_crowded_() || !reserve(wanted)) throw PreviewMemoryMissing{wanted};
}

}  // namespace ccslice::server
