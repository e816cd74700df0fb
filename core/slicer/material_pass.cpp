// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/slicer/material_pass.h"

#include <algorithm>
#include <string>

#include "core/base/error.h"
#include "core/slicer/nearest_solved.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kHintReach = 16;       // Columns.
constexpr std::uint32_t kVoxelsPerPoll = 256;  // Some hundred microseconds.

void append_voxel(std::vector<Span>& runs, std::uint32_t y, std::uint32_t x) {
  if (!runs.empty() && runs.back().y == y && runs.back().end == x) {
    ++runs.back().end;
  } else {
    runs.push_back({y, x, x + 1});
  }
}

}  // namespace

Vec3 MaterialPass::centre(std::uint32_t x, std::uint32_t y) const {
  return {lattice_.x0_mm + (x + 0.5) * lattice_.dx_mm, lattice_.y0_mm + (y + 0.5) * lattice_.dy_mm, z_mm_};
}

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
  if (!unresolved_.empty()) fill_unresolved(spans);
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
    const std::optional<InversionResult> found = field_->invert(centre(x, span.y), hint);
    if (!found) {
      append_voxel(unresolved_, span.y, x);
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

void MaterialPass::fill_unresolved(std::span<const Span> spans) {
  for (const Span& run : unresolved_) stats_->voxels_unresolved += run.end - run.begin;
  NearestSolved solved(spans, unresolved_, lattice_);
  if (solved.empty()) return fill_from_solid();
  for (const Span& run : unresolved_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      if ((x - run.begin) % kVoxelsPerPoll == 0) cancel_->throw_if_cancelled();
      const NearestSolved::Voxel source = solved.nearest(x, run.y);
      const std::size_t from = std::size_t{lattice_.width} * source.y + source.x;
      const std::size_t to = std::size_t{lattice_.width} * run.y + x;
      for (ContonePlane& plane : planes_) plane.copy(from, to);
    }
  }
}

void MaterialPass::fill_from_solid() {
  for (const Span& run : unresolved_) {
    for (std::uint32_t x = run.begin; x < run.end; ++x) {
      cancel_->throw_if_cancelled();
      const std::optional<InversionResult> found = field_->nearest(centre(x, run.y));
      if (!found) {
        throw Error(ErrorCode::kInternal, "no material for voxel (" + std::to_string(x) + ", " + std::to_string(run.y) +
                                              ") at z = " + std::to_string(z_mm_) + " mm, inside the contours");
      }
      set_samples(run, x, found->at);
    }
  }
}

}  // namespace ccslice
