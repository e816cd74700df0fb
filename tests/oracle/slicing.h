// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Slicing a subject and looking at what comes out, voxel by voxel.

#pragma once

#include <memory>
#include <vector>

#include "core/slicer/layer_slicer.h"
#include "tests/oracle/subject.h"
#include "tests/support/algorithm1.h"
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

/// What Algorithm 1 needs: limit evaluation from the core, boxes of control points from brute force.
class SubjectForAlgorithm1 final : public Algorithm1Solid {
 public:
  explicit SubjectForAlgorithm1(const Subject& subject);
  std::uint32_t cell_count() const override { return static_cast<std::uint32_t>(ring_boxes_.size()); }
  const Box3& ring_box(std::uint32_t cell) const override { return ring_boxes_[cell]; }
  const Box3& corner_box(std::uint32_t cell) const override { return corner_boxes_[cell]; }
  Vec3 geo(const CellParam& at) override { return evaluator_.geo(at); }
  void geo_and_jacobian(const CellParam& at, Vec3& position, Mat3& jacobian) override;
  LimitEvaluator& evaluator() { return evaluator_; }

 private:
  LimitEvaluator evaluator_;
  std::vector<Box3> ring_boxes_, corner_boxes_;
};

/// Compares a layer's channels with Algorithm 1's. Its hard clip fails beside irregular lines: counted, not compared.
struct Algorithm1Comparison {
  std::size_t compared = 0, not_found = 0;
  double worst = 0;
};
Algorithm1Comparison compare_with_algorithm1(const Subject& subject, SubjectForAlgorithm1& solid,
                                             const LayerView& view);

}  // namespace ccslice::oracle
