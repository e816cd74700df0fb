// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/limit/fold_search.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/limit/prepare.h"

namespace ccslice {

namespace {

constexpr std::size_t kMaxReportedFolds = 32;
constexpr std::uint64_t kHalvingsPerCell = 32;       // Granted on average: some 50 us.
constexpr std::uint64_t kHalvingsAtLeast = 1 << 14;  // For small meshes.

/// The patches of a cell, down to kFoldLevels at its irregular place.
FoldFinding examine_cell(const LimitCell& cell, PatchBuilder& builder, FoldSearch& search,
                         const CancellationToken& cancel) {
  FoldFinding worst;
  const auto look = [&](const PatchPath& path, double* grid) {
    cancel.throw_if_cancelled();
    bspline_to_bezier(grid, 3, kPositionDimension);
    BezierVolume net;
    for (std::size_t p = 0; p < 64; ++p) net[p] = {grid[4 * p], grid[4 * p + 1], grid[4 * p + 2], 0};
    // All frames are proper, so a patch's own Jacobian has the sign of the cell's; its size is that of its box.
    FoldFinding found = worst.verdict == FoldVerdict::kFolds ? FoldSearch::sample(net) : search.examine(net);
    const int halvings = 3 * (path.level + (path.child != 0)) + 2 * (path.line_level + (path.line_child != 0));
    found.determinant = std::ldexp(found.determinant, halvings);
    const FoldVerdict verdict = std::max(worst.verdict, found.verdict);
    if (found.determinant < worst.determinant) worst = found;
    worst.verdict = verdict;
  };
  const int line_levels = cell.cell_class == CellClass::kLine ? kFoldLevels : 1;
  builder.visit_patches(cell, kFoldLevels, line_levels, look, [](const Box3&) {});
  return worst;
}

}  // namespace

void find_folds(const CancellationToken& cancel, LimitSolid::Data& data) {
  PatchBuilder builder(data, kPositionDimension);
  FoldSearch search(kHalvingsAtLeast + kHalvingsPerCell * data.cells.size());
  std::vector<Box3> boxes;
  for (std::uint32_t c = 0; c < data.cells.size(); ++c) {
    const FoldFinding worst = examine_cell(data.cells[c], builder, search, cancel);
    if (worst.verdict == FoldVerdict::kUnfolded) continue;
    data.folding_cells.push_back(c);
    boxes.push_back(data.cell_boxes.box(c));
    if (worst.verdict == FoldVerdict::kUndecided) {
      ++data.summary.undecided_cells;
      continue;
    }
    ++data.summary.folding_cells;
    if (data.summary.folds.size() < kMaxReportedFolds) {
      data.summary.folds.push_back({c, data.cells[c].control_cell, worst.position, worst.determinant});
    }
  }
  data.fold_boxes = BoxTree(boxes, cancel);
}

}  // namespace ccslice
