// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The last guard of interpolated materials: of the voxels that polynomials paint, a few are inverted and compared.
//
// Bounds say what errors are at most (docs/tolerance.md); what they assume, and what nobody thought of, this looks for.
// Which voxels are compared follows from hashes of their absolute indices: about one of kVoxelsApart in each row, one
// of kRunsApart beginnings of runs and one of as many ends, as what polynomials paint beyond pieces lies there. If one
// is beyond the tolerance, all voxels of the layer's rows from a multiple of kRowsTogether to the next are inverted. So
// the same rows are, whatever the range, the region and the number of threads.

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/field/material_field.h"
#include "core/interpolation/cubic_polynomial.h"
#include "core/interpolation/interpolation_spec.h"
#include "core/job/grid.h"
#include "core/raster/occupancy.h"

namespace ccslice {

/// One thread.
class PaintGuard {
 public:
  static constexpr std::uint32_t kVoxelsApart = 16381;
  static constexpr std::uint32_t kRunsApart = 2048;

  /// REQUIRES: field outlives this and is of the spec's placement.
  PaintGuard(MaterialField& field, const InterpolationSpec& spec);

  /// Columns of the run to compare, in no order, some twice.
  std::span<const std::uint32_t> chosen(std::uint32_t layer, const VoxelRun& run);
  /// What the polynomials, one a channel, say of the voxel is within the tolerances. `hint`: a parameter near it.
  [[nodiscard]] bool agrees(std::uint32_t layer, std::uint32_t row, std::uint32_t column, const VoxelFrame& frame,
                            std::span<const CubicPolynomial> polynomials, const std::optional<CellParam>& hint);

 private:
  MaterialField* field_;
  const Grid grid_;
  const std::vector<ChannelTolerance> channels_;
  std::vector<std::uint32_t> chosen_;
  std::vector<double> values_;
};

}  // namespace ccslice
