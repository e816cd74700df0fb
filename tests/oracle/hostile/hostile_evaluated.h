// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where polynomials of a hostile job are off most, by evaluation of the solid (LimitEvaluator) one place at a time.
// What is searched is made of other samples, in blocks.

#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/interpolation/samples/cubic_polynomial.h"
#include "core/interpolation/samples/interpolation_spec.h"
#include "core/limit/limit_evaluator.h"
#include "core/slicer/channel_tolerances.h"
#include "tests/oracle/hostile/hostile_comparisons.h"
#include "tests/oracle/hostile/hostile_text.h"

namespace ccslice::oracle {

/// The largest value of a function over the unit cube, with two axes over its face z = 0, or nearly, and where it is:
/// of 9 places along each axis and what is reached uphill from the largest few.
template <int kAxes, typename Function>
std::pair<double, Vec3> find_largest(Function function) {
  constexpr int kPlaces = 9, kLayers = kAxes == 3 ? kPlaces : 1;
  constexpr std::size_t kStarts = 4;
  constexpr double kFirstStep = 0.06, kLastStep = 0.003;
  std::vector<std::pair<double, Vec3>> starts;
  for (int n = 0; n < kPlaces * kPlaces * kLayers; ++n) {
    const Vec3 at = Vec3(n % kPlaces, n / kPlaces % kPlaces, n / (kPlaces * kPlaces)) / (kPlaces - 1);
    starts.emplace_back(function(at), at);
  }
  std::partial_sort(starts.begin(), starts.begin() + kStarts, starts.end(),
                    [](const auto& a, const auto& b) { return a.first > b.first; });
  std::pair<double, Vec3> largest = starts.front();
  for (std::size_t start = 0; start < kStarts; ++start) {
    auto [value, at] = starts[start];
    for (double step = kFirstStep; step > kLastStep;) {
      bool higher = false;
      for (int way = 0; way < 2 * kAxes; ++way) {
        Vec3 next = at;
        next[way / 2] = std::clamp(next[way / 2] + (way % 2 == 0 ? step : -step), 0.0, 1.0);
        const double found = function(next);
        if (!(found > value)) continue;
        value = found, at = next, higher = true;
      }
      if (!higher) step /= 2;
    }
    if (value > largest.first) largest = {value, at};
  }
  return largest;
}

inline std::string vector_text(const Vec3& v) {
  return "(" + number(v.x()) + ", " + number(v.y()) + ", " + number(v.z()) + ")";
}

/// What polynomials are compared with.
struct Evaluated {
  explicit Evaluated(const HostileRun& run)
      : solid(run.solid),
        spec(interpolation_spec_of(run.job.job, run.solid->summary().channels)),
        voxel_of_mesh(ccslice::voxel_of_mesh(spec.placement, spec.grid)),
        evaluator(*solid),
        values(solid->channel_count()) {}

  /// The largest error of a polynomial of spec.channels[c] over a box of a cell's parameters, as a share of the
  /// tolerance, and where in the box that is. It counts at voxels for which counts(voxel) is true.
  template <typename Counts>
  std::pair<double, Vec3> find_worst(LimitCellId cell, const ParamBox& box, std::size_t c, const VoxelFrame& frame,
                                     const CubicPolynomial& polynomial, Counts counts) {
    const auto& [channel, tolerance] = spec.channels[c];
    return find_largest<3>([&](const Vec3& share) {
      const Vec3 uvw = box.low + share.cwiseProduct(box.high - box.low);
      const Vec3 voxel = voxel_of_mesh * evaluator.geo_and_mat({cell, uvw}, values);
      return counts(voxel) ? std::abs(value_at(polynomial, frame(voxel)) - values[channel]) / tolerance : 0.0;
    });
  }

  const ChannelRange& range(std::size_t c) const { return solid->summary().channels[spec.channels[c].channel]; }
  /// As a share of the channel's tolerance.
  double rounding(std::size_t c) const {
    constexpr double kRounding = 1e-11;  // Of the channel's largest value.
    return kRounding * std::max(std::abs(range(c).min), std::abs(range(c).max)) / spec.channels[c].tolerance;
  }

  std::shared_ptr<const LimitSolid> solid;
  InterpolationSpec spec;
  Placement voxel_of_mesh;
  LimitEvaluator evaluator;
  std::vector<double> values;
};

}  // namespace ccslice::oracle
