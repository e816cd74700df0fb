// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/limit/fold_search.h"
#include "core/limit/patch.h"
#include "core/limit/patch_path.h"
#include "core/prepare/id_ranges.h"
#include "core/prepare/line_folds.h"
#include "core/prepare/prepare.h"
#include "core/prepare/prepare_options.h"
#include "core/prepare/unfolded_proof.h"
#include "core/prepare/vertex_folds.h"

namespace ccslice {

namespace {

constexpr std::size_t kMaxReportedFolds = 32;
// Granted to a range of cells: room for one that takes long, and so much more for each. That is some 50 us a cell where
// ranges have 256 cells, and 0.5 s in all where there are so few cells that ranges have less.
constexpr std::uint64_t kHalvingsPerCell = 32, kHalvingsAtLeast = 1 << 14;
constexpr int kSubCellFoldLevels = 1;  // Levels of the line sub-cells of a vertex cell.
constexpr std::uint8_t kVertexFoldLevel = kFoldLevels + 3;
// Cells: the more there are, the more operators have eight of them. Most take some 2 MB.
constexpr std::uint32_t kLeastProvedTogether = 256, kMostProvedTogether = 4096;

/// Looks at one cell after the other.
class CellSearch {
 public:
  CellSearch(const LimitSolid::Data& data, const CancellationToken& cancel)
      : cancel_(cancel), builder_(data, kPositionDimension), lines_(data), vertices_(lines_) {}

  void start_range(std::uint32_t cells) { patches_.grant(kHalvingsAtLeast + kHalvingsPerCell * cells); }

  FoldFinding examine(const LimitCell& cell) {
    worst_ = {};
    const int line_levels = cell.cell_class == CellClass::kLine ? kFoldLevels : kSubCellFoldLevels;
    builder_.visit_patches(
        cell, kFoldLevels, line_levels, [&](const PatchPath& path, double* grid) { look_at_patch(path, grid); },
        [&](const PatchRest& rest) { rest.vertex ? look_beside_vertex(rest) : look_beside_line(rest); });
    return worst_;
  }

 private:
  bool folds() const { return worst_.verdict == FoldVerdict::kFolds; }

  void look_at_patch(const PatchPath& path, double* grid) {
    cancel_.throw_if_cancelled();
    bspline_to_bezier(grid, 3, kPositionDimension);
    BezierVolume net;
    for (std::size_t p = 0; p < 64; ++p) net[p] = Eigen::Vector4d::Map(grid + kPositionDimension * p);
    keep(folds() ? FoldSearch::sample(net) : patches_.examine(net), path);
  }

  void look_beside_line(const PatchRest& rest) {
    if (!folds()) keep(lines_.examine(rest.op, rest.points), rest.path);
  }

  /// Level by level where a sharp line leads to the vertex, else in one direction, so deep that all others are alike.
  void look_beside_vertex(const PatchRest& rest) {
    if (folds()) return;
    if (vertices_.has_sharp_edge(rest.vertex->corner())) {
      cancel_.throw_if_cancelled();
      return keep(vertices_.examine(*rest.vertex), rest.path);
    }
    constexpr PatchPath kPath{kVertexFoldLevel, 7, 0, 0};
    std::array<double, 64 * kPositionDimension> grid;
    for (int level = rest.path.level; level < kVertexFoldLevel; ++level) rest.vertex->descend();
    const CornerOperator::Child& child = rest.vertex->make_child(kPath.child, grid.data());
    fill_phantoms(grid.data(), 3, kPositionDimension, child.phantoms);
    bspline_to_bezier(grid.data(), 3, kPositionDimension);
    BezierVolume net;
    for (std::size_t p = 0; p < 64; ++p) net[p] = Eigen::Vector4d::Map(grid.data() + kPositionDimension * p);
    keep(FoldSearch::sample(net), kPath);
  }

  /// All frames are proper, so a patch's own Jacobian has the sign of the cell's; its size is that of its box.
  void keep(FoldFinding found, const PatchPath& path) {
    const int halvings = 3 * (path.level + (path.child != 0)) + 2 * (path.line_level + (path.line_child != 0));
    found.determinant = std::ldexp(found.determinant, halvings);
    const FoldVerdict verdict = std::max(worst_.verdict, found.verdict);
    if (found.determinant < worst_.determinant) worst_ = found;
    worst_.verdict = verdict;
  }

  const CancellationToken& cancel_;
  PatchBuilder builder_;
  FoldSearch patches_{0};
  LineFolds lines_;
  VertexFolds vertices_;
  FoldFinding worst_;  // The cell's worst finding.
};

/// What proves cells on one thread.
struct Prover {
  explicit Prover(const LimitSolid::Data& data)
      : lines(data),
        vertices(lines),
        proof(data, lines, vertices, {kFoldLevels, kFoldLevels, kSubCellFoldLevels, kVertexFoldLevel}) {}

  LineFolds lines;
  VertexFolds vertices;
  UnfoldedProof proof;
};

/// By cell: it is proved to be unfolded. Cells at the same vertex are looked at together, as they share its star.
std::vector<std::uint8_t> prove_unfolded(const PrepareOptions& options, const LimitSolid::Data& data) {
  std::vector<LimitCellId> order = IdRange<LimitCellId>(data.cells.size()).to_vector();
  std::ranges::stable_sort(order, {}, [&](LimitCellId c) { return data.cells[c].star_begin; });
  std::vector<std::uint8_t> proved(order.size());
  using Turn = Id<struct TurnKind>;
  const auto make_prover = [&] { return std::make_unique<Prover>(data); };
  const auto prove = [&](std::unique_ptr<Prover>& prover, const NumberedRange<Turn>& turns) {
    prover->proof.examine(std::span(order).subspan(*turns.ids.begin(), turns.ids.size()), options, proved);
  };
  const auto count = static_cast<std::uint32_t>(order.size());
  const std::uint32_t together = ids_per_range_of(count, kLeastProvedTogether, kMostProvedTogether);
  for_each_range(IdRange<Turn>(count), options.threads, together, make_prover, prove);
  return proved;
}

/// Keeps the cells that fold or may fold, and counts them.
void keep_fold_boxes(std::span<const FoldVerdict> verdicts, const CancellationToken& cancel, LimitSolid::Data& data) {
  data.summary.folding_cells = static_cast<std::size_t>(std::ranges::count(verdicts, FoldVerdict::kFolds));
  data.summary.undecided_cells = static_cast<std::size_t>(std::ranges::count(verdicts, FoldVerdict::kUndecided));
  const std::size_t count = data.summary.folding_cells + data.summary.undecided_cells;
  std::vector<Box3> boxes;
  boxes.reserve(count);
  data.fold_cells.reserve(count);
  for (const LimitCellId c : IdRange<LimitCellId>(verdicts.size())) {
    if (verdicts[c] == FoldVerdict::kUnfolded) continue;
    boxes.push_back(data.cell_boxes.box(c));
    data.fold_cells.push_back(c);
  }
  data.fold_boxes = BoxTree(boxes, cancel);
}

}  // namespace

void find_folds(const PrepareOptions& options, LimitSolid::Data& data) {
  const auto count = static_cast<std::uint32_t>(data.cells.size());
  const std::uint32_t per_range = ids_per_range_of(count);
  // All cells of a mesh may fold: what isn't reported is known by a byte.
  std::vector<std::vector<FoldPlace>> folds(range_count(count, per_range));
  std::vector<FoldVerdict> verdicts(count, FoldVerdict::kUnfolded);
  options.begin(PreparationStep::kFolding, count);
  {
    const std::vector<std::uint8_t> proved = prove_unfolded(options, data);
    // A search refers to parts of itself, so it can't move.
    const auto make_search = [&] { return std::make_unique<CellSearch>(data, options.cancel); };
    const IdRange<LimitCellId> all(count);
    for_each_range(all, options.threads, per_range, make_search,
                   [&](std::unique_ptr<CellSearch>& search, const auto& range) {
                     options.cancel.throw_if_cancelled();
                     search->start_range(range.ids.size());
                     std::vector<FoldPlace>& found = folds[range.number];
                     std::uint64_t searched = 0;
                     for (const LimitCellId c : range.ids) {
                       if (proved[c]) continue;
                       const FoldFinding worst = search->examine(data.cells[c]);
                       verdicts[c] = worst.verdict;
                       if (worst.verdict == FoldVerdict::kFolds && found.size() < kMaxReportedFolds) {
                         found.push_back({c, data.cells[c].control_cell, worst.position, worst.determinant});
                       }
                       ++searched;
                     }
                     options.count(searched);
                   });
  }
  for (const std::vector<FoldPlace>& found : folds) {
    const std::size_t left = kMaxReportedFolds - data.summary.folds.size();
    data.summary.folds.insert(data.summary.folds.end(), found.begin(),
                              found.begin() + static_cast<std::ptrdiff_t>(std::min(left, found.size())));
  }
  keep_fold_boxes(verdicts, options.cancel, data);
}

}  // namespace ccslice
