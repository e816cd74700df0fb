// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/slab_materials.h"

#include <cstddef>
#include <set>
#include <utility>
#include <vector>

#include "core/interpolation/fits/cubic_painter.h"
#include "core/interpolation/paint_guard.h"
#include "core/interpolation/pieces/cell_node_store.h"
#include "core/interpolation/pieces/piece_cover.h"
#include "core/interpolation/pieces/piece_finder.h"
#include "core/interpolation/pieces/slab_pieces.h"
#include "core/interpolation/tiles/tile_painter.h"
#include "core/interpolation/tiles/tile_tree.h"
#include "core/interpolation/tiles/tile_tree_builder.h"
#include "core/job/slice_job.h"

namespace ccslice {
namespace {

constexpr std::size_t kRunsPerPoll = 4096, kRunsPerGuardPoll = 256;
constexpr std::size_t kRunsAhead = 12;

}  // namespace

class SlabMaterials::State {
 public:
  State(std::shared_ptr<const LimitSolid> solid, MaterialField& field, const InterpolationSpec& spec,
        const std::shared_ptr<CellNodeStore>& store, const RowRange& rows)
      : grid_(spec.grid),
        guard_(field, spec),
        pieces_(solid, spec, store->tiles_fit(solid, spec)),
        blocks_(std::make_shared<VoxelBlocks>(*solid, spec, store->stencils_of(*solid))),
        piece_finder_(solid, spec, store, rows, blocks_),
        tiles_(spec.grid, spec.channels.size()),
        tile_builder_(solid, field, spec, store->tiles_fit(solid, spec), blocks_),
        tile_painter_(field, spec.channels) {}

  void start(std::uint32_t first_layer, std::uint32_t end_layer);
  WindowOutcome paint(const LayerTarget& target, std::uint32_t layer, const SpansOfLayer& spans_of);

 private:
  struct Layer {
    bool is_covered = false, is_guarded = false;
    PieceCover cover;
    std::vector<RowRange> repainted;  // Rows that the guard has inverted.
  };

  const PieceCover& cover_of(std::uint32_t layer, const SpansOfLayer& spans_of, const CancellationToken& cancel);
  void guard(std::uint32_t layer, std::span<const VoxelRun> spans, const CancellationToken& cancel);
  [[nodiscard]] bool agrees(std::uint32_t layer, const PieceRun& run, std::span<const std::uint32_t> columns);
  [[nodiscard]] bool agrees(std::uint32_t layer, const VoxelRun& run, std::span<const std::uint32_t> columns);
  void build_tiles(const SpansOfLayer& spans_of, const CancellationToken& cancel);
  void paint_pieces(const LayerTarget& target, std::uint32_t layer, std::span<const PieceRun> runs);

  const Grid grid_;
  PaintGuard guard_;
  SlabPieces pieces_;
  const std::shared_ptr<VoxelBlocks> blocks_;  // Pieces and tiles take turns.
  PieceFinder piece_finder_;
  TileTree tiles_;  // Tiles of voxels that no piece paints.
  TileTreeBuilder tile_builder_;
  TilePainter tile_painter_;
  std::uint32_t first_layer_ = 0;
  std::vector<Layer> layers_;
  RunsByRow sorted_runs_;  // Of the layer that is being covered.
  bool tiles_built_ = false;
  LayerCubics cubics_;  // Cubics of the pieces.
};

SlabMaterials::SlabMaterials(std::shared_ptr<const LimitSolid> solid, MaterialField& field,
                             const InterpolationSpec& spec, std::shared_ptr<CellNodeStore> store, const RowRange& rows)
    : state_(std::make_unique<State>(std::move(solid), field, spec, store ? std::move(store) : make_cell_node_store(),
                                     rows)) {}
SlabMaterials::~SlabMaterials() = default;
SlabMaterials::SlabMaterials(SlabMaterials&&) noexcept = default;
SlabMaterials& SlabMaterials::operator=(SlabMaterials&&) noexcept = default;

void SlabMaterials::start(std::uint32_t first_layer, std::uint32_t end_layer) { state_->start(first_layer, end_layer); }

WindowOutcome SlabMaterials::paint(const LayerTarget& target, std::uint32_t layer, const SpansOfLayer& spans_of) {
  return state_->paint(target, layer, spans_of);
}

void SlabMaterials::State::start(std::uint32_t first_layer, std::uint32_t end_layer) {
  first_layer_ = first_layer;
  layers_.resize(end_layer - first_layer);
  for (Layer& layer : layers_) layer.is_covered = layer.is_guarded = false;
  tiles_built_ = false;
  cubics_.clear();
  pieces_.start(first_layer, end_layer);
}

const PieceCover& SlabMaterials::State::cover_of(std::uint32_t layer, const SpansOfLayer& spans_of,
                                                 const CancellationToken& cancel) {
  Layer& found = layers_[layer - first_layer_];
  if (found.is_covered) return found.cover;
  piece_finder_.find(layer, pieces_, cancel);
  found.cover.resolve(pieces_, layer, grid_.extent.rows, spans_of(layer), sorted_runs_);
  found.is_covered = true;
  return found.cover;
}

void SlabMaterials::State::build_tiles(const SpansOfLayer& spans_of, const CancellationToken& cancel) {
  std::vector<std::span<const VoxelRun>> runs;
  for (std::uint32_t l = 0; l < layers_.size(); ++l) {
    cancel.throw_if_cancelled();
    runs.push_back(cover_of(first_layer_ + l, spans_of, cancel).for_tiles());
  }
  tile_painter_.start_slab();
  tile_builder_.build(first_layer_, runs, cancel, tiles_);
  tiles_built_ = true;
}

/// Has rows inverted where a voxel that was chosen is beyond its tolerance.
void SlabMaterials::State::guard(std::uint32_t layer, std::span<const VoxelRun> spans,
                                 const CancellationToken& cancel) {
  Layer& guarded = layers_[layer - first_layer_];
  if (guarded.is_guarded) return;
  guarded.repainted.clear();
  std::set<std::uint32_t> blocks;
  const auto look_at = [&](const auto& runs) {
    for (std::size_t r = 0; r < runs.size(); ++r) {
      if (r % kRunsPerGuardPoll == 0) cancel.throw_if_cancelled();
      const std::span<const std::uint32_t> columns = guard_.chosen(layer, runs[r]);
      if (!columns.empty() && !agrees(layer, runs[r], columns)) blocks.insert(runs[r].row / kRowsTogether);
    }
  };
  look_at(guarded.cover.painted());
  look_at(guarded.cover.for_tiles());
  for (const VoxelRun& gap : guarded.cover.closed_gaps()) {
    const std::optional<std::uint32_t> column = guard_.chosen_in_gap(layer, gap);
    if (!column) continue;
    const PieceRun* run = guarded.cover.painted_at(gap.row, *column);
    if (run != nullptr && !agrees(layer, *run, {&*column, 1})) blocks.insert(gap.row / kRowsTogether);
  }
  for (const std::uint32_t block : blocks) {
    guarded.repainted.push_back({block * kRowsTogether, (block + 1) * kRowsTogether});
    guarded.cover.invert(guarded.repainted.back(), spans);
  }
  guarded.is_guarded = true;  // Unless it was cancelled.
}

bool SlabMaterials::State::agrees(std::uint32_t layer, const PieceRun& run, std::span<const std::uint32_t> columns) {
  for (const std::uint32_t column : columns) {
    const CellParam hint = pieces_.parameter_near(run.piece, Vec3(column, run.row, layer));
    if (!guard_.agrees(layer, run.row, column, pieces_.piece(run.piece).frame, pieces_.polynomials(run.piece), hint)) {
      return false;
    }
  }
  return true;
}

bool SlabMaterials::State::agrees(std::uint32_t layer, const VoxelRun& run, std::span<const std::uint32_t> columns) {
  for (const std::uint32_t column : columns) {
    const auto cubics = tiles_.cubics_at({column, run.row, layer});
    if (cubics && !guard_.agrees(layer, run.row, column, cubics->frame, cubics->polynomials, {})) return false;
  }
  return true;
}

WindowOutcome SlabMaterials::State::paint(const LayerTarget& target, std::uint32_t layer,
                                          const SpansOfLayer& spans_of) {
  const PieceCover& cover = cover_of(layer, spans_of, target.cancel);
  if (!cover.for_tiles().empty() && !tiles_built_) build_tiles(spans_of, target.cancel);
  guard(layer, spans_of(layer), target.cancel);
  for (const RowRange& repainted : layers_[layer - first_layer_].repainted) {
    for (const VoxelRun& span : spans_of(layer)) {
      if (span.row >= repainted.begin && span.row < repainted.end) target.stats.voxels_repainted += target.count(span);
    }
  }
  paint_pieces(target, layer, cover.painted());
  return tile_painter_.paint(tiles_, target, layer, cover.for_tiles(), cover.to_invert(), spans_of(layer));
}

void SlabMaterials::State::paint_pieces(const LayerTarget& target, std::uint32_t layer,
                                        std::span<const PieceRun> runs) {
  const CubicPainter painter(target, layer, pieces_.channels());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r % kRunsPerPoll == 0) target.cancel.throw_if_cancelled();
    if (r + kRunsAhead < runs.size()) {
      const std::uint32_t ahead = runs[r + kRunsAhead].piece;
      prefetch(&pieces_.piece(ahead));
      cubics_.prefetch_for(ahead, pieces_.polynomials(ahead));
    }
    const PieceRun& run = runs[r];
    const VoxelFrame& frame = pieces_.piece(run.piece).frame;
    painter.paint(frame, cubics_.of(run.piece, frame, pieces_.polynomials(run.piece), layer), run.row, run.begin,
                  run.end);
  }
}

}  // namespace ccslice
