// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The last guard of interpolated materials: of the voxels that polynomials paint, a few are inverted and compared.
//
// Bounds say what errors are at most (docs/tolerance.md); what they assume, and what nobody thought of, this looks for.
// Which voxels are compared follows from hashes of their absolute indices: about one of kVoxelsApart in each row, one
// of kRunsApart beginnings of runs and one of as many ends, and one in one of kGapsApart gaps between pieces that were
// closed: what polynomials paint beyond pieces lies there, and gaps are few. An inversion takes as long as painting 50
// to 500 voxels, so that higher rates would cost more than a twentieth of the time. If a voxel is beyond the tolerance,
// all voxels of the layer's rows from a multiple of kRowsTogether to the next are inverted. So the same rows are,
// whatever the range, the region and the number of threads.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/field/material_field.h"
#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/job/grid.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// One thread.
class PaintGuard {
 public:
  static constexpr std::uint32_t kVoxelsApart = 12281;
  static constexpr std::uint32_t kRunsApart = 2048;
  static constexpr std::uint32_t kGapsApart = 256;

  /// REQUIRES: field outlives this and is of the spec's placement.
  PaintGuard(MaterialField& field, const InterpolationSpec& spec);

  /// Columns of the run to compare, in no order, some twice. Valid until the next call. Few of many runs have any;
  /// those of a row are asked about fastest one after the other.
  std::span<const std::uint32_t> chosen(std::uint32_t layer, const VoxelRun& run) {
    if (layer != layer_ || run.row != row_ || run.begin < begin_) start_row(layer, run.row);
    begin_ = run.begin;
    while (next_ < run.begin) next_ += kVoxelsApart;
    const bool first = is_chosen_end(run.begin), last = is_chosen_end(run.end);
    if (!first && !last && next_ >= run.end) return {};
    return collect(run, first, last);
  }
  /// A voxel of the gap to compare, if it is chosen. Those of a row are asked about fastest one after the other.
  std::optional<std::uint32_t> chosen_in_gap(std::uint32_t layer, const VoxelRun& gap) {
    if (layer != layer_ || gap.row != row_) start_row(layer, gap.row);
    const std::uint64_t hash = mixed(~(of_row_ + gap.begin));
    if (hash % kGapsApart != 0) return std::nullopt;
    return gap.begin + static_cast<std::uint32_t>((hash >> 32) % (gap.end - gap.begin));
  }
  /// What the polynomials, one a channel, say of the voxel is within the tolerances. `hint`: a parameter near it.
  [[nodiscard]] bool agrees(std::uint32_t layer, std::uint32_t row, std::uint32_t column, const VoxelFrame& frame,
                            std::span<const CubicPolynomial> polynomials, const std::optional<CellParam>& hint);

 private:
  /// Spreads a number's bits over all 64 (the finalizer of SplitMix64: Steele, Lea, Flood, Fast splittable pseudorandom
  /// number generators, 2014).
  static std::uint64_t mixed(std::uint64_t number) {
    number = (number ^ number >> 30) * 0xbf58476d1ce4e5b9;
    number = (number ^ number >> 27) * 0x94d049bb133111eb;
    return number ^ number >> 31;
  }
  /// Where a run of the row at hand begins or ends.
  bool is_chosen_end(std::uint32_t column) const { return mixed(of_row_ + column) % kRunsApart == 0; }
  void start_row(std::uint32_t layer, std::uint32_t row);
  std::span<const std::uint32_t> collect(const VoxelRun& run, bool first, bool last);

  MaterialField* field_;
  const Grid grid_;
  const std::vector<ChannelTolerance> channels_;
  std::vector<std::uint32_t> chosen_;
  std::vector<double> values_;

  // The row at hand: where the last run began, and the first of the columns kVoxelsApart from there on.
  std::uint32_t layer_, row_, begin_ = 0;
  std::uint64_t of_row_, next_;
};

}  // namespace ccslice
