// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/layer_slicer.h"

#include <utility>
#include <vector>

#include "core/job/copies.h"
#include "core/slicer/layer_composer.h"

namespace ccslice {

// What all workers on a job read.
struct LayerSlicer::Shared {
  PlacedParts parts;
  /// The painter of a part, and how far the part is from what that paints.
  struct Painting {
    std::size_t group;
    VoxelShift shift;
  };
  std::vector<std::shared_ptr<const PartPainter::Shared>> groups;
  std::vector<Painting> painting;  // By part.
};

struct LayerSlicer::State {
  /// A painter, and the layer of which it has painted its group.
  struct Group {
    PartPainter painter;
    bool is_painted = false;
  };
  const Shared& shared;
  std::vector<Group> groups;
  LayerComposer composer;
  std::vector<PaintedPart> painted;  // In the composer's order.

  explicit State(const Shared& the_shared) : shared(the_shared), composer(shared.parts) {
    for (const auto& group : shared.groups) groups.emplace_back(Group{PartPainter(group)});
  }

  Layer slice(std::uint32_t layer, const CancellationToken& cancel) {
    painted.clear();
    for (Group& group : groups) {
      group.painter.find(layer, cancel);
      group.is_painted = false;
    }
    LayerWindow window;
    for (const auto& [group, shift] : shared.painting) {
      window = joint_window(window, groups[group].painter.window(shift));
    }
    composer.start(layer, whole_bytes(window));
    for (const std::uint32_t part : composer.order()) {
      const auto& [number, shift] = shared.painting[part];
      Group& group = groups[number];
      if (group.painter.is_outside(shift)) continue;
      if (!std::exchange(group.is_painted, true)) group.painter.paint(cancel);
      painted.push_back(group.painter.copy(shift, cancel));
      composer.add(part, painted.back(), cancel);
      painted.back().materials = {};
    }
    return composer.finish(cancel);
  }
};

LayerSlicer::LayerSlicer(PlacedParts parts, const CancellationToken& cancel,
                         std::span<const std::optional<bool>> tiles_fit)
    : LayerSlicer([&] {
        Shared shared{std::move(parts), {}, {}};
        shared.painting.resize(shared.parts.size());
        const std::vector<CopyGroup> groups = copy_groups(shared.parts);
        for (const CopyGroup& group : groups) {
          const std::uint32_t part = group.copies.front().part;
          const std::optional<bool> fit = tiles_fit.empty() ? std::nullopt : tiles_fit[part];
          const auto* before = shared.parts[part].is_copy ? shared.groups.back().get() : nullptr;
          for (const CopyGroup::Copy& copy : group.copies) {
            shared.painting[copy.part] = {shared.groups.size(), copy.shift};
          }
          shared.groups.push_back(PartPainter::share(shared.parts, group, groups.size(), cancel, fit, before));
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
