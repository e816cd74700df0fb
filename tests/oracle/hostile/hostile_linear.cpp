// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Channels that are linear in the position: their limit is, too, so every voxel's value is known without its parameter.

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_layers.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {
namespace {

constexpr double kRoundingOfFloats = 0x1p-22;  // Of the control points' channels, of the value, of the arithmetic.

/// One channel of one plane.
class LinearComparison {
 public:
  LinearComparison(const HostileRun& run, const ChannelSamples& samples, HostileFinding& finding)
      : run_(run), samples_(samples), finding_(finding) {
    const SliceJob& job = run.job.job;
    const Placement mesh_of_world = job.placement.inverse(Eigen::Affine);
    const LinearMaterial& material = *run.linear[samples.channel];
    slope_ = mesh_of_world.linear().transpose() * material.slope;
    base_ = material(mesh_of_world.translation());
    const ChannelRange& channel = run.solid->summary().channels[samples.channel];
    rounding_ = 0.5 * samples.quantum() + kRoundingOfFloats * (std::max(std::abs(channel.min), std::abs(channel.max)) +
                                                               std::max(0.0, samples.range.max - samples.range.min));
    // A voxel off the solid is as far from it as that where the placement shrinks lengths most.
    const double least_scale = scales_of(job.placement)[2];
    rounding_ += material.slope.norm() * (job.contour_tolerance_mm + kOutsideSlackMm) / least_scale;
  }

  void compare(const EncodedPlane& plane, const Layer& layer) {
    const GridExtent& extent = run_.job.job.grid.extent;
    for (std::uint32_t row = 0; row < extent.rows; ++row) {
      for (std::uint32_t column = 0; column < extent.columns; ++column) {
        if (bit_at(layer.planes.back(), extent.columns, column, row)) compare(plane, layer.index, column, row);
      }
    }
  }

 private:
  void compare(const EncodedPlane& plane, std::uint32_t layer, std::uint32_t column, std::uint32_t row) {
    const double value = samples_.value(plane, std::size_t{row} * run_.job.job.grid.extent.columns + column);
    double expected = base_ + slope_.dot(run_.centre(column, row, layer));
    if (samples_.type != SampleType::kFloat32) expected = std::clamp(expected, samples_.range.min, samples_.range.max);
    const double off = std::abs(value - expected) - rounding_;
    const double ratio =
        std::isnan(off) ? std::numeric_limits<double>::infinity() : std::max(0.0, off) / samples_.tolerance;
    ++finding_.compared;
    finding_.failed += ratio > 1;
    if (ratio <= finding_.worst) return;
    finding_.worst = ratio;
    if (ratio <= 1) return;
    finding_.where = "voxel " + std::to_string(column) + "," + std::to_string(row) + "," + std::to_string(layer) +
                     " channel " + run_.solid->summary().channels[samples_.channel].name + ": " + number(value) +
                     ", by its place " + number(expected) + " +- " + number(rounding_ + samples_.tolerance);
  }

  const HostileRun& run_;
  const ChannelSamples& samples_;
  HostileFinding& finding_;
  Vec3 slope_;
  double base_ = 0, rounding_ = 0;
};

}  // namespace

void compare_linear(const HostileRun& run, HostileFinding& finding) {
  const std::vector<PlaneSpec>& planes = run.job.job.planes;
  for (std::size_t plane = 0; plane < planes.size(); ++plane) {
    for (const ChannelSamples& samples : samples_of(*run.solid, run.job.job, planes[plane])) {
      if (!run.linear[samples.channel]) continue;
      LinearComparison comparison(run, samples, finding);
      for (const Layer& layer : run.layers) {
        if (layer.stats.voxels_unresolved == 0) comparison.compare(layer.planes[plane], layer);
      }
    }
  }
}

}  // namespace ccslice::oracle
