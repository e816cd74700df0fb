// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/paint_guard.h"

#include <cmath>

namespace ccslice {

PaintGuard::PaintGuard(MaterialField& field, const InterpolationSpec& spec)
    : field_(&field), grid_(spec.grid), channels_(spec.channels), values_(field.channel_count()) {
  start_row(0, 0);
}

void PaintGuard::start_row(std::uint32_t layer, std::uint32_t row) {
  layer_ = layer;
  row_ = row;
  of_row_ = mixed(std::uint64_t{layer} << 32 | row);
  next_ = of_row_ % kVoxelsApart;
}

/// `first`, `last`: is_chosen_end() of the run's ends.
std::span<const std::uint32_t> PaintGuard::collect(const VoxelRun& run, bool first, bool last) {
  chosen_.clear();
  for (std::uint64_t column = next_; column < run.end; column += kVoxelsApart) {
    chosen_.push_back(static_cast<std::uint32_t>(column));
  }
  if (first) chosen_.push_back(run.begin);
  if (last) chosen_.push_back(run.end - 1);
  return chosen_;
}

bool PaintGuard::agrees(std::uint32_t layer, std::uint32_t row, std::uint32_t column, const VoxelFrame& frame,
                        std::span<const CubicPolynomial> polynomials, const std::optional<CellParam>& hint) {
  const std::optional<InversionResult> found =
      field_->invert(grid_.lattice().centre(column, row, grid_.layer_z_mm(layer)), hint);
  if (!found) return false;
  field_->mat(found->at, values_);
  const Vec3 place = frame(Vec3(column, row, layer));
  for (std::size_t c = 0; c < channels_.size(); ++c) {
    const double error = value_at(polynomials[c], place) - values_[channels_[c].channel];
    if (!(std::abs(error) <= channels_[c].tolerance)) return false;
  }
  return true;
}

}  // namespace ccslice
