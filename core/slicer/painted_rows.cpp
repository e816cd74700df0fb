// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/painted_rows.h"

#include <algorithm>
#include <limits>
#include <optional>

namespace ccslice {
namespace {

constexpr std::uint32_t kNoRow = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kNoPiece = std::numeric_limits<std::uint32_t>::max();
constexpr std::uint32_t kMostAlone = 32;  // Voxels of a run that needs no tile.

}  // namespace

void PaintedRows::resolve(const CellPieces& pieces, std::uint32_t layer, std::uint32_t rows,
                          std::span<const Span> spans) {
  pieces_ = &pieces;
  layer_ = layer;
  row_ = kNoRow;
  painted_.clear();
  alone_.clear();
  rest_.clear();
  beside_rest_.clear();
  sort_by_row(pieces.runs(layer), rows);
  for (const Span& span : spans) {
    if (span.y != row_) enter_row(span.y);
    resolve_span(span);
  }
  sort_out_rest();
}

/// Moves what has a hint from rest_ to alone_.
void PaintedRows::sort_out_rest() {
  std::size_t kept = 0;
  for (std::size_t r = 0; r < rest_.size(); ++r) {
    const Span run = rest_[r];
    const Vec3 first(run.begin, run.y, layer_);
    std::optional<CellParam> hint;
    if (run.end - run.begin <= kMostAlone) {
      hint = pieces_->parameter_in_hole(first);
      if (!hint && beside_rest_[r] != kNoPiece) hint = pieces_->parameter_near(beside_rest_[r], first);
    }
    if (hint) {
      alone_.push_back({run, *hint});
    } else {
      rest_[kept++] = run;
    }
  }
  rest_.resize(kept);
}

void PaintedRows::sort_by_row(std::span<const PieceRun> runs, std::uint32_t rows) {
  row_begins_.assign(rows + std::size_t{2}, 0);
  for (const PieceRun& run : runs) ++row_begins_[run.row + 2];
  for (std::size_t r = 2; r < row_begins_.size(); ++r) row_begins_[r] += row_begins_[r - 1];
  by_row_.resize(runs.size());
  for (const PieceRun& run : runs) by_row_[row_begins_[run.row + 1]++] = run;
}

void PaintedRows::enter_row(std::uint32_t row) {
  row_ = row;
  found_ = std::span(by_row_).subspan(row_begins_[row], row_begins_[row + 1] - row_begins_[row]);
  std::sort(found_.begin(), found_.end(), [](const PieceRun& a, const PieceRun& b) {
    return a.begin != b.begin ? a.begin < b.begin : a.piece < b.piece;
  });
}

void PaintedRows::resolve_span(const Span& span) {
  while (!found_.empty() && found_.front().end <= span.begin) found_ = found_.subspan(1);
  std::uint32_t at = span.begin;  // Up to here voxels are painted or left.
  for (const PieceRun& next : found_) {
    if (next.begin >= span.end) break;
    if (next.end > span.begin) at = paint_next(next, at, span);
  }
  if (at < span.end) close_gap(at, span.end, painted_before(at), nullptr);
}

std::uint32_t PaintedRows::paint_next(const PieceRun& next, std::uint32_t at, const Span& span) {
  const std::uint32_t begin = std::max(next.begin, span.begin), end = std::min(next.end, span.end);
  if (begin < at) compare_overlap(next, begin, std::min(at, end));
  if (begin > at) {
    const PieceRun* before = painted_before(at);
    before != nullptr || at == span.begin ? close_gap(at, begin, before, &next) : leave(at, begin, kNoPiece);
  }
  paint(std::max(begin, at), end, next.piece);
  return std::max(at, end);
}

/// Voxels that are painted, and that the next piece would paint too: they are left where the two differ.
void PaintedRows::compare_overlap(const PieceRun& next, std::uint32_t begin, std::uint32_t end) {
  if (painted_.empty() || painted_.back().row != row_) return;
  const PieceRun last = painted_.back();
  begin = std::max(begin, last.begin);
  end = std::min(end, last.end);
  if (begin >= end) return;
  if (pieces_->agree(last.piece, next.piece, voxel(begin)) && pieces_->agree(last.piece, next.piece, voxel(end - 1))) {
    return;
  }
  painted_.pop_back();
  paint(last.begin, begin, last.piece);
  leave(begin, end, last.piece);
  paint(end, last.end, last.piece);
}

/// Paints voxels that no piece holds, half from either side, or leaves them. REQUIRES: before or after.
void PaintedRows::close_gap(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const PieceRun* after) {
  if ((before == nullptr && after == nullptr) || !is_sure(begin, end, before, after)) {
    return leave(begin, end, before == nullptr ? kNoPiece : before->piece);
  }
  const std::uint32_t middle = before == nullptr ? begin : after == nullptr ? end : begin + (end - begin) / 2;
  if (before != nullptr) paint(begin, middle, before->piece);
  if (after != nullptr) paint(middle, end, after->piece);
}

bool PaintedRows::is_sure(std::uint32_t begin, std::uint32_t end, const PieceRun* before, const PieceRun* after) const {
  for (const PieceRun* run : {before, after}) {
    if (run != nullptr && end - begin > pieces_->piece(run->piece).reach) return false;
  }
  for (std::uint32_t x = begin; x < end; ++x) {
    if (pieces_->is_in_hole(voxel(x))) return false;
  }
  if (before == nullptr || after == nullptr) return true;
  return pieces_->agree(before->piece, after->piece, voxel(begin)) &&
         pieces_->agree(before->piece, after->piece, voxel(end - 1));
}

/// What ends at a column of the row at hand, or null.
const PieceRun* PaintedRows::painted_before(std::uint32_t column) const {
  if (painted_.empty() || painted_.back().row != row_ || painted_.back().end != column) return nullptr;
  return &painted_.back();
}

/// Leaves those that may lie beyond what the piece can say.
void PaintedRows::paint(std::uint32_t begin, std::uint32_t end, std::uint32_t piece) {
  if (!pieces_->piece(piece).has_beyond) return paint_all(begin, end, piece);
  const auto is_beyond = [&](std::uint32_t x) { return pieces_->may_be_beyond(piece, voxel(x)); };
  while (begin < end) {
    const bool beyond = is_beyond(begin);
    std::uint32_t next = begin + 1;
    while (next < end && is_beyond(next) == beyond) ++next;
    beyond ? leave(begin, next, piece) : paint_all(begin, next, piece);
    begin = next;
  }
}

void PaintedRows::paint_all(std::uint32_t begin, std::uint32_t end, std::uint32_t piece) {
  if (begin >= end) return;
  if (painted_before(begin) != nullptr && painted_.back().piece == piece) {
    painted_.back().end = end;
  } else {
    painted_.push_back({row_, begin, end, piece});
  }
  if (!rest_.empty() && rest_.back().y == row_ && rest_.back().end == begin && beside_rest_.back() == kNoPiece) {
    beside_rest_.back() = piece;
  }
}

/// `beside`: a piece beside them, or none.
void PaintedRows::leave(std::uint32_t begin, std::uint32_t end, std::uint32_t beside) {
  if (begin >= end) return;
  if (!rest_.empty() && rest_.back().y == row_ && rest_.back().end == begin) {
    rest_.back().end = end;
    if (beside_rest_.back() == kNoPiece) beside_rest_.back() = beside;
    return;
  }
  std::size_t at = rest_.size();
  while (at > 0 && rest_[at - 1].y == row_ && rest_[at - 1].begin >= end) --at;
  rest_.insert(rest_.begin() + static_cast<std::ptrdiff_t>(at), {row_, begin, end});
  beside_rest_.insert(beside_rest_.begin() + static_cast<std::ptrdiff_t>(at), beside);
}

}  // namespace ccslice
