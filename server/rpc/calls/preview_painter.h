// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of a call's meshes, within the memory that the server has for slicing.

#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/cancellation.h"
#include "core/preview/layer_painter.h"
#include "core/preview/plane_painter.h"
#include "server/rpc/convert/convert_preview.h"
#include "server/service/meshes/mesh_cache.h"
#include "server/service/scheduling/memory_budget.h"

namespace ccslice::server {

/// A picture takes so much memory, and there isn't that much now.
struct PreviewMemoryMissing {
  std::uint64_t bytes = 0;
};

/// One thread at a time. What planes of one orientation and layers of one job share is kept from picture to picture.
/// paint() throws PreviewMemoryMissing, ServiceError{kJobExceedsMemory} where there will never be enough, and what the
/// painters of the core throw.
class PreviewPainter {
 public:
  /// Free planes are of the first mesh. `is_crowded`: whether others wait for the memory, so that it mustn't be taken
  /// without waiting too.
  PreviewPainter(std::vector<MeshPtr> meshes, MemoryBudget& scratch, std::function<bool()> is_crowded);

  /// Takes the memory of a picture, if there is as much. REQUIRES: no more than there is in all.
  [[nodiscard]] bool reserve(std::uint64_t bytes) noexcept;
  /// So much needn't wait behind long work: Admission::Memory.
  bool is_short(std::uint64_t bytes) const noexcept;
  std::uint64_t reserved_bytes() const noexcept { return share_.bytes(); }
  PreviewPicture paint(const PreviewJob& job, PreviewStage stage, const CancellationToken& cancel);
  /// `key`: equal for requests whose layers are of one job.
  PreviewPicture paint(const LayerPreview& preview, const std::string& key, const CancellationToken& cancel);

 private:
  void require_memory(std::uint64_t cut_bytes, const LayerWindow& window);

  const std::vector<MeshPtr> meshes_;
  const MemoryBudget& scratch_;
  const std::function<bool()> is_crowded_;
  PlanePainter planes_;
  std::optional<LayerPainter> layers_;
  std::string layers_key_;
  std::uint64_t plane_bytes_ = 0;  // That free planes take to cut the solid.
  MemoryBudget::Share share_;
};

}  // namespace ccslice::server
