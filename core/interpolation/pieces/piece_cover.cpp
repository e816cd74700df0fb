// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/pieces/piece_cover.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/base/prefetch.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kNoPiece = std::numeric_limits<std::uint32_t>::max();
constexpr std::size_t kRowsOfRunsAhead = 8;
constexpr std::uint32_t kMostShort = 32;   // Voxels of a short run. A tile would cost more than inverting them.
constexpr std::uint32_t kMostLong = 1024;  // Voxels of all longer runs in kRowsTogether rows: fewer need no tiles.

/// Columns from a centre to the run's piece.
double before_begin(const ScannedRun& run, std::uint32_t column) {
  return static_cast<double>(run.begin) - run.before - column;
}

}  // namespace

/// A counting sort, which leaves runs of a row in the order of their pieces. Counts stand two places on, so that once
/// they are summed [row + 1] is where the row begins. Putting its runs in place moves that on to where it ends, which
/// is where the next one begins.
void RunsByRow::sort(std::span<const ScannedRun> runs, std::uint32_t rows) {
  row_begins_.assign(rows + std::size_t{2}, 0);
  for (const ScannedRun& run : runs) ++row_begins_[run.row + 2];
  for (std::size_t r = 2; r < row_begins_.size(); ++r) row_begins_[r] += row_begins_[r - 1];
  runs_.resize(runs.size());
  for (std::size_t r = 0; r < runs.size(); ++r) {
    if (r + kRowsOfRunsAhead < runs.size()) prefetch(&runs_[row_begins_[runs[r + kRowsOfRunsAhead].row + 1]]);
    runs_[row_begins_[runs[r].row + 1]++] = runs[r];
  }
}

void PieceCover::resolve(const SlabPieces& pieces, std::uint32_t layer, std::uint32_t rows,
                         std::span<const VoxelRun> spans, RunsByRow& sorted) {
  pieces_ = &pieces;
  layer_ = layer;
  row_ = kNoRow;
  painted_.clear();
  closed_gaps_.clear();
  to_invert_.clear();
  unpainted_.clear();
  beside_unpainted_.clear();
  sorted.sort(pieces.runs(layer), rows);
  for (const VoxelRun& span : spans) {
    if (span.row != row_) enter_row(span.row, sorted);
    resolve_span(span);
  }
  sort_out_unpainted();
}

void PieceCover::invert(const RowRange& rows, std::span<const VoxelRun> spans) {
  const auto is_theirs = [&](std::uint32_t row) { return row >= rows.begin && row < rows.end; };
  std::erase_if(painted_, [&](const PieceRun& run) { return is_theirs(run.row); });
  std::erase_if(unpainted_, [&](const VoxelRun& run) { return is_theirs(run.row); });
  std::erase_if(to_invert_, [&](const HintedRun& each) { return is_theirs(each.row); });
  std::vector<HintedRun> all;
  for (const VoxelRun& span : spans) {
    if (is_theirs(span.row)) all.push_back({span, {}});
  }
  const auto after = std::ranges::find_if(to_invert_, [&](const HintedRun& each) { return each.row >= rows.end; });
  to_invert_.insert(after, all.begin(), all.end());
}

/// Moves what needs no tile from unpainted_ to to_invert_: runs in holes that pieces don't pay in, short runs beside
/// pieces, and others that aren't for tiles if the rows that are cut into tiles together have few of them.
void PieceCover::sort_out_unpainted() {
  hints_.clear();
  in_hole_.clear();
  for (std::size_t r = 0; r < unpainted_.size(); ++r) find_hint_of(r);
  std::size_t kept = 0;
  for (std::size_t begin = 0, end = 0; begin < unpainted_.size(); begin = end) {
    // By kRowsTogether rows, at whose ends tiles end, too: what becomes of a row depends on those rows only.
    const std::uint32_t block = unpainted_[begin].row / kRowsTogether;
    std::uint32_t voxels = 0;
    for (; end < unpainted_.size() && unpainted_[end].row / kRowsTogether == block; ++end) {
      if (!needs_no_tile(end) && !is_for_tiles(end)) voxels += unpainted_[end].end - unpainted_[end].begin;
    }
    for (std::size_t r = begin; r < end; ++r) {
      if (needs_no_tile(r) || (voxels <= kMostLong && !is_for_tiles(r))) {
        to_invert_.push_back({unpainted_[r], hints_[r]});
      } else {
        unpainted_[kept++] = unpainted_[r];
      }
    }
  }
  unpainted_.resize(kept);
}

void PieceCover::find_hint_of(std::size_t run) {
  const Vec3 first(unpainted_[run].begin, unpainted_[run].row, layer_);
  std::optional<CellParam> hint = pieces_->parameter_in_hole(first);
  in_hole_.push_back(hint.has_value());
  if (!hint && beside_unpainted_[run] != kNoPiece) hint = pieces_->parameter_near(beside_unpainted_[run], first);
  hints_.push_back(hint);
}

bool PieceCover::needs_no_tile(std::size_t run) const {
  return in_hole_[run] || (hints_[run] && unpainted_[run].end - unpainted_[run].begin <= kMostShort);
}

bool PieceCover::is_for_tiles(std::size_t run) const {
  return pieces_->is_for_tiles(Vec3(unpainted_[run].begin, unpainted_[run].row, layer_));
}

void PieceCover::enter_row(std::uint32_t row, const RunsByRow& sorted) {
  row_ = row;
  const std::span<const ScannedRun> runs = sorted.of_row(row);
  // Numbers are sorted several times as fast as runs.
  by_column_.clear();
  for (std::size_t r = 0; r < runs.size(); ++r) by_column_.push_back(std::uint64_t{runs[r].begin} << 32 | r);
  std::sort(by_column_.begin(), by_column_.end());
  found_.clear();
  for (const std::uint64_t key : by_column_) {
    found_.push_back(runs[static_cast<std::uint32_t>(key)]);
    prefetch(&pieces_->piece(found_.back().piece));
  }
  first_found_ = 0;
}

void PieceCover::resolve_span(const VoxelRun& span) {
  while (first_found_ < found_.size() && found_[first_found_].end <= span.begin) ++first_found_;
  std::uint32_t at = span.begin;  // Up to here voxels are painted or left.
  for (const ScannedRun& next : std::span(found_).subspan(first_found_)) {
    if (next.begin >= span.end) break;
    // Runs come by their begins, not by their ends: some may end before the span.
    if (next.end > span.begin) at = paint_next(next, at, span);
  }
  if (at < span.end) close_gap(at, span.end, painted_before(at), nullptr);
}

std::uint32_t PieceCover::paint_next(const ScannedRun& next, std::uint32_t at, const VoxelRun& span) {
  const std::uint32_t begin = std::max(next.begin, span.begin), end = std::min(next.end, span.end);
  if (begin < at) compare_overlap(next, begin, std::min(at, end));
  if (begin > at) {
    // Unless the span begins here, voxels before the gap were left because no piece was sure of them: it is left, too.
    const PieceRun* before = painted_before(at);
    before != nullptr || at == span.begin ? close_gap(at, begin, before, &next) : leave(at, begin, kNoPiece);
  }
  paint({row_, std::max(begin, at), end, next.piece}, next.after);
  return std::max(at, end);
}

/// Voxels that are painted, and that the next piece would paint too: they are left where the two differ.
void PieceCover::compare_overlap(const ScannedRun& next, std::uint32_t begin, std::uint32_t end) {
  const auto differs = [&](const PieceRun& run) {
    return !agree(run.piece, next.piece, std::max(begin, run.begin), std::min(end, run.end));
  };
  // Only the last painted runs reach in. They are taken off and painted again, less what is left of them.
  std::size_t first = painted_.size();
  while (first > 0 && painted_[first - 1].row == row_ && painted_[first - 1].end > begin) --first;
  overlapped_.assign(painted_.begin() + static_cast<std::ptrdiff_t>(first), painted_.end());
  if (std::ranges::none_of(overlapped_, differs)) return;
  const float after = after_;
  painted_.resize(first);
  for (const PieceRun& run : overlapped_) {
    if (!differs(run)) {
      paint_all(run, after);
      continue;
    }
    const std::uint32_t low = std::max(begin, run.begin), high = std::min(end, run.end);
    if (run.begin < low) paint_all({row_, run.begin, low, run.piece}, 0);
    leave(low, high, run.piece);
    if (high < run.end) paint_all({row_, high, run.end, run.piece}, after);
  }
}

/// Paints voxels that no piece holds, each from the side that is nearer, or leaves them.
void PieceCover::close_gap(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const ScannedRun* after) {
  if ((before == nullptr && after == nullptr) || !is_sure(begin, end, before, after)) {
    return leave(begin, end, before == nullptr ? kNoPiece : before->piece);
  }
  closed_gaps_.push_back({row_, begin, end});
  std::uint32_t middle = before == nullptr ? begin : end;
  if (before != nullptr && after != nullptr) {
    while (middle > begin && beyond_painted(middle - 1) > before_begin(*after, middle - 1)) --middle;
  }
  if (before != nullptr) paint({row_, begin, middle, before->piece}, 0);
  if (after != nullptr) paint({row_, middle, end, after->piece}, 0);
}

bool PieceCover::is_sure(std::uint32_t begin, std::uint32_t end, const PieceRun* before,
                         const ScannedRun* after) const {
  const auto is_reached = [this](std::uint32_t piece, double columns) {
    const double reach = pieces_->piece(piece).reach;
    return reach > 0 && columns <= reach;
  };
  if (before != nullptr && !is_reached(before->piece, beyond_painted(end - 1))) return false;
  if (after != nullptr && !is_reached(after->piece, before_begin(*after, begin))) return false;
  // What lies beside a hole says nothing of the hole's own material.
  for (std::uint32_t x = begin; x < end; ++x) {
    if (pieces_->is_in_hole(voxel(x))) return false;
  }
  // At the end of a run of voxels some may lie off the solid: only a piece that ends there knows how far.
  if (before == nullptr) return pieces_->piece(after->piece).at_boundary;
  if (after == nullptr) return pieces_->piece(before->piece).at_boundary;
  return agree(before->piece, after->piece, begin, end);
}

/// At all voxels from one column to another: whichever of two pieces holds one, the other is within the tolerance
/// there.
bool PieceCover::agree(std::uint32_t a, std::uint32_t b, std::uint32_t begin, std::uint32_t end) const {
  for (std::uint32_t x = begin; x < end; ++x) {
    if (!pieces_->agree(a, b, voxel(x))) return false;
  }
  return true;
}

const PieceRun* PieceCover::painted_at(std::uint32_t row, std::uint32_t column) const {
  const auto ends_before = [&](const PieceRun& run) { return run.row < row || (run.row == row && run.end <= column); };
  const auto run = std::ranges::partition_point(painted_, ends_before);
  return run != painted_.end() && run->row == row && run->begin <= column ? &*run : nullptr;
}

/// What ends at a column of the row at hand, or null.
const PieceRun* PieceCover::painted_before(std::uint32_t column) const {
  if (painted_.empty() || painted_.back().row != row_ || painted_.back().end != column) return nullptr;
  return &painted_.back();
}

/// Columns from the piece that was painted last to a centre after it.
double PieceCover::beyond_painted(std::uint32_t column) const { return column - (painted_.back().end - 1.0) - after_; }

/// Most of a run, if it is only at one of its ends that voxels may lie beyond the piece's faces, as where it meets an
/// interface.
PieceRun PieceCover::surely_none_beyond(const SlabPieces::Row& row, const PieceRun& run) const {
  for (std::uint32_t ends = 2; 2 * ends < run.end - run.begin; ends *= 4) {
    if (row.surely_none_is_beyond(voxel(run.begin), voxel(run.end - ends - 1)))
      return {row_, run.begin, run.end - ends, run.piece};
    if (row.surely_none_is_beyond(voxel(run.begin + ends), voxel(run.end - 1)))
      return {row_, run.begin + ends, run.end, run.piece};
  }
  return {row_, run.end, run.end, run.piece};
}

/// `after`: as ScannedRun's. Leaves those that may lie beyond what the piece can say.
void PieceCover::paint(const PieceRun& run, float after) {
  if (run.begin >= run.end) return;
  if (!pieces_->piece(run.piece).has_beyond()) return paint_all(run, after);
  const SlabPieces::Row row(*pieces_, run.piece, voxel(run.begin));
  if (row.none_is_beyond(voxel(run.begin), voxel(run.end - 1))) return paint_all(run, after);
  const PieceRun sure = surely_none_beyond(row, run);
  const auto is_beyond = [&](std::uint32_t x) {
    return !(x >= sure.begin && x < sure.end) && row.may_be_beyond(voxel(x));
  };
  PieceRun part = run;
  for (; part.begin < run.end; part.begin = part.end) {
    const bool beyond = is_beyond(part.begin);
    part.end = part.begin + 1;
    while (part.end < run.end && is_beyond(part.end) == beyond) ++part.end;
    beyond ? leave(part.begin, part.end, run.piece) : paint_all(part, after);
  }
}

void PieceCover::paint_all(const PieceRun& run, float after) {
  if (painted_before(run.begin) != nullptr && painted_.back().piece == run.piece) {
    painted_.back().end = run.end;
  } else {
    painted_.push_back(run);
  }
  after_ = after;
  if (!unpainted_.empty() && unpainted_.back().row == row_ && unpainted_.back().end == run.begin &&
      beside_unpainted_.back() == kNoPiece) {
    beside_unpainted_.back() = run.piece;
  }
}

/// `beside`: a piece beside them, or none.
void PieceCover::leave(std::uint32_t begin, std::uint32_t end, std::uint32_t beside) {
  if (begin >= end) return;
  if (!unpainted_.empty() && unpainted_.back().row == row_ && unpainted_.back().end == begin) {
    unpainted_.back().end = end;
    if (beside_unpainted_.back() == kNoPiece) beside_unpainted_.back() = beside;
    return;
  }
  // compare_overlap() may leave voxels before some that were left already.
  std::size_t at = unpainted_.size();
  while (at > 0 && unpainted_[at - 1].row == row_ && unpainted_[at - 1].begin >= end) --at;
  unpainted_.insert(unpainted_.begin() + static_cast<std::ptrdiff_t>(at), {row_, begin, end});
  beside_unpainted_.insert(beside_unpainted_.begin() + static_cast<std::ptrdiff_t>(at), beside);
}

}  // namespace ccslice
