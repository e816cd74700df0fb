// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Slicing a subject and looking at what comes out, voxel by voxel.

#pragma once

#include <memory>
#include <vector>

#include "core/job/slice_job.h"
#include "tests/oracle/subject.h"
#include "tests/support/algorithm1.h"
#include "tests/support/limit_solid_for_algorithm1.h"
#include "tests/support/winding_number.h"

namespace ccslice::oracle {

/// Plane 0: the occupancy; then every channel as raw floats. Every voxel is inverted.
SliceJob float_job(const Subject& subject, const VoxelPitch& pitch);
/// The same with about `columns` voxels along the longest side of the box, and as many layers as it takes.
SliceJob float_job(const Subject& subject, int columns);

class LayerView {
 public:
  LayerView(const SliceJob& job, const Layer& layer) : grid_(job.grid), layer_(layer) {}

  bool inside(std::uint32_t x, std::uint32_t y) const;
  double channel(std::uint32_t c, std::uint32_t x, std::uint32_t y) const;
  Vec3 centre(std::uint32_t x, std::uint32_t y) const;
  const Grid& grid() const { return grid_; }

 private:
  Grid grid_;
  const Layer& layer_;
};

std::vector<Polygon> polygons_of(const Contours& contours);

/// By brute force.
CellBoxes brute_force_boxes(const Subject& subject);

/// Compares a layer's channels with Algorithm 1's. Its hard clip fails beside irregular lines: counted, not compared.
struct Algorithm1Comparison {
  std::size_t compared = 0, not_found = 0;
  double worst = 0;
};
Algorithm1Comparison compare_with_algorithm1(const Subject& subject, LimitSolidForAlgorithm1& solid,
                                             const LayerView& view);

}  // namespace ccslice::oracle
