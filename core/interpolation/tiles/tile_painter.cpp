// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/tiles/tile_painter.h"

namespace ccslice {
namespace {

bool is_before(const VoxelRun& a, const VoxelRun& b) { return a.row != b.row ? a.row < b.row : a.begin < b.begin; }

}  // namespace

WindowOutcome TilePainter::paint(const TileTree& tree, const LayerTarget& target, std::uint32_t layer,
                                 std::span<const VoxelRun> for_tiles, std::span<const HintedRun> to_invert,
                                 std::span<const VoxelRun> inside) {
  const CubicPainter painter(target, layer, channels_);
  const auto paint_leaf = [&](const TileTree::Node& leaf, const VoxelRun& part) {
    if (leaf.kind == TileTree::Node::Kind::kExact) return add_exact(target, tree.hint(leaf.index), part);
    const auto [frame, polynomials] = tree.cubics(leaf.index);
    painter.paint(frame, cubics_.of(leaf.index, frame, polynomials, layer), part.row, part.begin, part.end);
  };
  const auto invert = [&](const HintedRun& run) {
    solve_exact_run(target);
    exact_.solve_from(target, run);
  };
  exact_.start_layer();
  exact_run_ = {};
  for (const VoxelRun& run : for_tiles) {
    if (run.row >= target.window.end_row()) break;
    for (; !to_invert.empty() && is_before(to_invert.front(), run); to_invert = to_invert.subspan(1)) {
      invert(to_invert.front());
    }
    tree.visit_leaves(layer, run, paint_leaf);
  }
  for (const HintedRun& run : to_invert) {
    if (run.row >= target.window.end_row()) break;
    invert(run);
  }
  solve_exact_run(target);
  return exact_.finish_layer(target, inside);
}

/// Neighbouring leaves of a row are inverted together.
void TilePainter::add_exact(const LayerTarget& target, const std::optional<CellParam>& hint, const VoxelRun& run) {
  if (exact_run_.row == run.row && exact_run_.end == run.begin && exact_run_.begin < exact_run_.end) {
    exact_run_.end = run.end;
    return;
  }
  solve_exact_run(target);
  exact_run_ = {run, hint};
}

void TilePainter::solve_exact_run(const LayerTarget& target) {
  if (exact_run_.begin < exact_run_.end) exact_.solve(target, exact_run_, exact_run_.hint);
  exact_run_ = {};
}

}  // namespace ccslice
