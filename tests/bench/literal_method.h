// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The method as the paper prints it [Luu19, 3.2]: the winding number of every voxel of the bitmap, and Algorithm 1 for
// every voxel inside, over the same contours and with the same limit evaluation as ours. One thread.
//
// It takes too long for whole layers, so whole rows of them are timed, in bands: the row before a band is done first
// but not timed, for Algorithm 1 starts from the row before.

#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/field/contone.h"
#include "tests/bench/our_method.h"
#include "tests/bench/printer_job.h"
#include "tests/support/limit_solid_for_algorithm1.h"
#include "tests/support/winding_number.h"

namespace ccslice::bench {

/// CPU time, and what it was spent on.
struct LiteralCost {
  double winding_ns = 0, material_ns = 0;
  std::uint64_t rows = 0, voxels = 0;
  std::uint64_t full = 0;         // Voxels inverted by the whole Algorithm 1.
  std::uint64_t not_found = 0;    // Of these, how many without success.
  std::uint64_t disagreeing = 0;  // Voxels whose occupancy differs from ours.

  LiteralCost& operator+=(const LiteralCost& other);
};

class LiteralMethod {
 public:
  explicit LiteralMethod(const PrinterJob& job);

  /// Rows [first_row, first_row + rows) of a layer. Without coherence every voxel is inverted by the whole Algorithm 1.
  LiteralCost run_band(const LayerShape& shape, std::uint32_t first_row, std::uint32_t rows, bool coherence);

 private:
  void test_occupancy(std::uint32_t row, LiteralCost& cost);
  void invert_row(std::uint32_t row, bool coherence, LiteralCost& cost);
  void load(const LayerShape& shape);

  const PrinterJob& job_;
  LayerLattice lattice_;
  oracle::LimitSolidForAlgorithm1 solid_;
  oracle::Algorithm1 algorithm_;
  std::vector<double> values_;
  ContonePlane plane_;
  // Of the layer at hand.
  std::optional<std::uint32_t> layer_;
  double z_mm_ = 0;
  std::vector<oracle::Polygon> polygons_;
  BitImage occupancy_;  // Ours.
  // Of the row at hand, by column.
  std::vector<Vec3> points_;
  std::vector<bool> inside_;
  std::vector<std::optional<CellParam>> line_, previous_;
};

}  // namespace ccslice::bench
