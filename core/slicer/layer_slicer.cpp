// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_slicer.h"

#include <utility>
#include <vector>

#include "core/slicer/layer_composer.h"

namespace ccslice {

// What all workers on a job read.
struct LayerSlicer::Shared {
  PlacedParts parts;
  std::vector<std::shared_ptr<const PartPainter::Shared>> painting;  // By part.
};

struct LayerSlicer::State {
  std::vector<PartPainter> painters;  // By part.
  LayerComposer composer;
  std::vector<PaintedPart> painted;  // In the composer's order.

  explicit State(const Shared& shared) : composer(shared.parts) {
    for (const auto& painting : shared.painting) painters.emplace_back(painting);
  }

  Layer slice(std::uint32_t layer, const CancellationToken& cancel) {
    painted.clear();
    LayerWindow window;
    for (const std::uint32_t part : composer.order()) {
      painted.push_back(painters[part].paint(layer, cancel));
      window = joint_window(window, painted.back().window);
    }
    composer.start(layer, window);
    for (std::size_t k = 0; k < painted.size(); ++k) composer.add(composer.order()[k], painted[k], cancel);
    return composer.finish(cancel);
  }
};

LayerSlicer::LayerSlicer(PlacedParts parts, const CancellationToken& cancel,
                         std::span<const std::optional<bool>> tiles_fit)
    : LayerSlicer([&] {
        Shared shared{std::move(parts), {}};
        for (std::size_t part = 0; part < shared.parts.size(); ++part) {
          const std::optional<bool> fit = tiles_fit.empty() ? std::nullopt : tiles_fit[part];
          const auto* before = shared.parts[part].is_copy ? shared.painting.back().get() : nullptr;
          shared.painting.push_back(PartPainter::share(shared.parts[part], cancel, fit, before));
        }
        return std::make_shared<const Shared>(std::move(shared));
      }()) {}
LayerSlicer::LayerSlicer(std::shared_ptr<const LimitSolid> solid, SliceJob job, const CancellationToken& cancel,
                         std::span<const std::optional<bool>> tiles_fit)
    : LayerSlicer(PlacedParts{{"", std::move(solid), std::move(job)}}, cancel, tiles_fit) {}
LayerSlicer::LayerSlicer(std::shared_ptr<const Shared> shared) : shared_(std::move(shared)) {}
LayerSlicer::~LayerSlicer() = default;
LayerSlicer::LayerSlicer(LayerSlicer&&) noexcept = default;
LayerSlicer& LayerSlicer::operator=(LayerSlicer&&) noexcept = default;

LayerSlicer LayerSlicer::twin() const { return LayerSlicer(shared_); }

Layer LayerSlicer::slice(std::uint32_t layer, const CancellationToken& cancel) {
  if (!state_) state_ = std::make_unique<State>(*shared_);
  return state_->slice(layer, cancel);
}

std::span<const PaintedPart> LayerSlicer::painted() const {
  return state_ ? std::span<const PaintedPart>(state_->painted) : std::span<const PaintedPart>();
}

}  // namespace ccslice
