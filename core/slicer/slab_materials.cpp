// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/slab_materials.h"

#include <cstddef>
#include <set>
#include <utility>

namespace ccslice {
namespace {

constexpr std::size_t kRunsPerPoll = 4096, kRunsPerGuardPoll = 256;
constexpr std::size_t kRunsAhead = 12;

}  // namespace

SlabMaterials::SlabMaterials(std::shared_ptr<const LimitSolid> solid, MaterialField& field,
                             const InterpolationSpec& spec, std::shared_ptr<PieceStore> store, const RowRange& rows)
    : grid_(spec.grid),
      guard_(field, spec),
      pieces_(solid, spec, std::move(store), rows),
      tiles_(std::move(solid), field, spec) {}

void SlabMaterials::start(std::uint32_t first_layer, std::uint32_t end_layer) {
  first_layer_ = first_layer;
  layers_.resize(end_layer - first_layer);
  for (Layer& layer : layers_) layer.resolved = layer.guarded = false;
  tiles_solved_ = false;
  cubics_.clear();
  pieces_.start(first_layer, end_layer);
}

const PaintedRows& SlabMaterials::rows_of(std::uint32_t layer, const SpansOfLayer& spans_of,
                                          const CancellationToken& cancel) {
  Layer& found = layers_[layer - first_layer_];
  if (found.resolved) return found.rows;
  pieces_.find(layer, cancel);
  found.rows.resolve(pieces_, layer, grid_.extent.rows, spans_of(layer));
  found.resolved = true;
  return found.rows;
}

void SlabMaterials::solve_tiles(const SpansOfLayer& spans_of, const CancellationToken& cancel) {
  std::vector<std::span<const Span>> rests;
  for (std::uint32_t l = 0; l < layers_.size(); ++l) {
    cancel.throw_if_cancelled();
    rests.push_back(rows_of(first_layer_ + l, spans_of, cancel).rest());
  }
  tiles_.solve(first_layer_, rests, cancel);
  tiles_solved_ = true;
}

/// Has rows inverted where a voxel that was chosen is beyond its tolerance.
void SlabMaterials::guard(std::uint32_t layer, std::span<const Span> spans, const CancellationToken& cancel) {
  Layer& guarded = layers_[layer - first_layer_];
  if (guarded.guarded) return;
  guarded.repainted.clear();
  std::set<std::uint32_t> blocks;
  const auto look_at = [&](const auto& runs, auto row_of) {
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (r % kRunsPerGuardPoll == 0) cancel.throw_if_cancelled();
      const std::uint32_t block = row_of(runs[r]) / kRowsTogether;
      if (!agrees(layer, runs[r])) blocks.insert(block);
    }
  };
  look_at(guarded.rows.painted(), [](const PieceRun& run) { return run.row; });
  look_at(guarded.rows.rest(), [](const Span& run) { return run.y; });
  for (const std::uint32_t block : blocks) {
    guarded.repainted.push_back({block * kRowsTogether, (block + 1) * kRowsTogether});
    guarded.rows.invert(guarded.repainted.back(), spans);
  }
  guarded.guarded = true;  // Unless it was cancelled.
}

bool SlabMaterials::agrees(std::uint32_t layer, const PieceRun& run) {
  for (const std::uint32_t column : guard_.chosen(layer, {run.row, run.begin, run.end})) {
    const CellParam hint = pieces_.parameter_near(run.piece, Vec3(column, run.row, layer));
    if (!guard_.agrees(layer, run.row, column, pieces_.piece(run.piece).frame, pieces_.polynomials(run.piece), hint)) {
      return false;
    }
  }
  return true;
}

bool SlabMaterials::agrees(std::uint32_t layer, const Span& run) {
  for (const std::uint32_t column : guard_.chosen(layer, run)) {
    const auto paint = tiles_.paint_of(layer, run.y, column);
    if (paint && !guard_.agrees(layer, run.y, column, paint->frame, paint->polynomials, {})) return false;
  }
  return true;
}

bool SlabMaterials::paint(const LayerTarget& target, std::uint32_t layer, const SpansOfLayer& spans_of) {
  const PaintedRows& rows = rows_of(layer, spans_of, target.cancel);
  if (!rows.rest().empty() && !tiles_solved_) solve_tiles(spans_of, target.cancel);
  guard(layer, spans_of(layer), target.cancel);
  for (const RowRange& repainted : layers_[layer - first_layer_].repainted) {
    for (const Span& span : spans_of(layer)) {
      if (span.y >= repainted.begin && span.y < repainted.end) target.stats.voxels_repainted += target.count(span);
    }
  }
  paint_pieces(target, layer, rows.painted());
  return tiles_.paint(target, layer, rows.rest(), rows.alone(), spans_of(layer));
}

void SlabMaterials::paint_pieces(const LayerTarget& target, std::uint32_t layer, std::span<const PieceRun> runs) {
  const CubicPainter painter(target, layer, pieces_.channels());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r % kRunsPerPoll == 0) target.cancel.throw_if_cancelled();
    if (r + kRunsAhead < runs.size()) {
      const std::uint32_t ahead = runs[r + kRunsAhead].piece;
      prefetch(&pieces_.piece(ahead));
      cubics_.prefetch_for(ahead, pieces_.polynomials(ahead));
    }
    const PieceRun& run = runs[r];
    const TileFrame& frame = pieces_.piece(run.piece).frame;
    painter.paint(frame, cubics_.of(run.piece, frame, pieces_.polynomials(run.piece), layer), run.row, run.begin,
                  run.end);
  }
}

}  // namespace ccslice
