// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/interpolation/paint_guard.h"

#include <cmath>

namespace ccslice {
namespace {

/// Spreads a number's bits over all 64 (the finalizer of SplitMix64: Steele, Lea, Flood, Fast splittable pseudorandom
/// number generators, 2014).
std::uint64_t mixed(std::uint64_t number) {
  number = (number ^ number >> 30) * 0xbf58476d1ce4e5b9;
  number = (number ^ number >> 27) * 0x94d049bb133111eb;
  return number ^ number >> 31;
}

}  // namespace

PaintGuard::PaintGuard(MaterialField& field, const InterpolationSpec& spec)
    : field_(&field), grid_(spec.grid), channels_(spec.channels), values_(field.channel_count()) {}

std::span<const std::uint32_t> PaintGuard::chosen(std::uint32_t layer, const VoxelRun& run) {
  chosen_.clear();
  const std::uint64_t of_row = mixed(std::uint64_t{layer} << 32 | run.row);
  const auto place = static_cast<std::uint32_t>(of_row % kVoxelsApart);
  std::uint64_t column = run.begin - run.begin % kVoxelsApart + place;
  if (column < run.begin) column += kVoxelsApart;
  for (; column < run.end; column += kVoxelsApart) chosen_.push_back(static_cast<std::uint32_t>(column));
  if (mixed(of_row + run.begin) % kRunsApart == 0) chosen_.push_back(run.begin);
  if (mixed(of_row + run.end) % kRunsApart == 0) chosen_.push_back(run.end - 1);
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
