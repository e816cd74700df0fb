// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_pass.h"

#include <algorithm>

namespace ccslice {
namespace {

constexpr std::uint32_t kHintReach = 16;       // Columns.
constexpr std::uint32_t kVoxelsPerPoll = 256;  // Some hundred microseconds.

}  // namespace

void MaterialPass::run(std::span<const Span> spans, const LayerLattice& lattice, double z_mm,
                       std::span<ContonePlane> planes, LayerStats& stats, const CancellationToken& cancel) {
  lattice_ = lattice;
  z_mm_ = z_mm;
  planes_ = planes;
  stats_ = &stats;
  cancel_ = &cancel;
  unresolved_.clear();
  row_.assign(lattice.width, std::nullopt);
  row_below_.assign(lattice.width, std::nullopt);
  row_y_.reset();
  for (const Span& span : spans) {
    if (row_y_ != span.y) start_row(span.y);
    solve_span(span);
  }
  unresolved_.fill(*field_, spans, lattice, z_mm, planes, stats, cancel);
}

void MaterialPass::start_row(std::uint32_t y) {
  row_.swap(row_below_);
  if (row_y_ && *row_y_ + 1 != y) std::fill(row_below_.begin(), row_below_.end(), std::nullopt);
  std::fill(row_.begin(), row_.end(), std::nullopt);
  row_y_ = y;
}

std::optional<CellParam> MaterialPass::hint_from_row_below(std::uint32_t x) const {
  for (std::uint32_t distance = 0; distance <= kHintReach; ++distance) {
    if (distance <= x && row_below_[x - distance]) return row_below_[x - distance];
    if (distance < row_below_.size() - x && row_below_[x + distance]) return row_below_[x + distance];
  }
  return std::nullopt;
}

void MaterialPass::solve_span(const Span& span) {
  for (std::uint32_t x = span.begin; x < span.end; ++x) {
    if ((x - span.begin) % kVoxelsPerPoll == 0) cancel_->throw_if_cancelled();
    std::optional<CellParam> hint;
    if (x > span.begin) hint = row_[x - 1];
    if (!hint) hint = hint_from_row_below(x);
    const std::optional<InversionResult> found = field_->invert(lattice_.centre(x, span.y, z_mm_), hint);
    if (!found) {
      unresolved_.add(span.y, x);
      continue;
    }
    ++(found->full ? stats_->voxels_full : stats_->voxels_coherent);
    stats_->max_residual_mm = std::max(stats_->max_residual_mm, found->residual_mm);
    row_[x] = found->at;
    set_samples(span, x, found->at);
  }
}

void MaterialPass::set_samples(const Span& span, std::uint32_t x, const CellParam& at) {
  field_->mat(at, values_);
  const std::size_t index = std::size_t{lattice_.width} * span.y + x;
  for (ContonePlane& plane : planes_) plane.set(index, values_);
}

}  // namespace ccslice
