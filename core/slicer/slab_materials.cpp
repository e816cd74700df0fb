// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slab_materials.h"

#include <cstddef>
#include <utility>

#include "core/slicer/cubic_painter.h"

namespace ccslice {
namespace {

constexpr std::size_t kRunsPerPoll = 4096;

}  // namespace

SlabMaterials::SlabMaterials(std::shared_ptr<const LimitSolid> solid, const Placement& placement, MaterialField& field,
                             const Grid& grid, const std::vector<ChannelTolerance>& channels)
    : grid_(grid), pieces_(std::move(solid), placement, grid, channels), tiles_(field, grid, channels) {}

void SlabMaterials::solve(std::uint32_t first_layer, std::span<const std::span<const Span>> layers,
                          const CancellationToken& cancel) {
  first_layer_ = first_layer;
  pieces_.build(first_layer, first_layer + static_cast<std::uint32_t>(layers.size()), cancel);
  rows_.resize(layers.size());
  std::vector<std::span<const Span>> rests;
  for (std::size_t l = 0; l < layers.size(); ++l) {
    cancel.throw_if_cancelled();
    rows_[l].resolve(pieces_, first_layer + static_cast<std::uint32_t>(l), grid_.extent.rows, layers[l]);
    rests.push_back(rows_[l].rest());
  }
  tiles_.solve(first_layer, rests, cancel);
}

void SlabMaterials::paint(const LayerTarget& target, std::uint32_t layer, std::span<const Span> spans) {
  const PaintedRows& rows = rows_[layer - first_layer_];
  paint_pieces(target, layer, rows.painted());
  tiles_.paint(target, layer, rows.rest(), spans);
}

void SlabMaterials::paint_pieces(const LayerTarget& target, std::uint32_t layer, std::span<const PieceRun> runs) const {
  const CubicPainter painter(target, layer, pieces_.channels());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r % kRunsPerPoll == 0) target.cancel.throw_if_cancelled();
    const PieceRun& run = runs[r];
    painter.paint(pieces_.piece(run.piece).frame, pieces_.polynomials(run.piece), run.row, run.begin, run.end);
  }
}

}  // namespace ccslice
