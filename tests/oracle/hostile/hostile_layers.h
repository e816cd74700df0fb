// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Layers of hostile jobs: slicing them, and reading their samples.

#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "core/slicer/layer_slicer.h"

namespace ccslice::oracle {

/// Layers [first, first + count) of a job, in order.
std::vector<Layer> slice_layers(const std::shared_ptr<const LimitSolid>& solid, const SliceJob& job,
                                std::uint32_t first, std::uint32_t count, int threads = 1);

/// The same grid with every voxel inverted. Planes: the occupancy, then every channel of the solid as floats, then the
/// cell regions if it has any, then the materials if the job prints, both a byte a voxel. With contours.
SliceJob inverting_job(const LimitSolid& solid, const SliceJob& job);

bool bit_at(const EncodedPlane& plane, std::uint32_t columns, std::uint32_t column, std::uint32_t row);

/// A channel's samples among those of a plane.
struct ChannelSamples {
  std::uint32_t channel = 0;
  SampleType type = SampleType::kFloat32;
  std::size_t index = 0, stride = 1;  // Samples of a voxel.
  ValueRange range;                   // Of integers: what 0 and the largest stand for.
  double tolerance = 0;               // In the channel's unit.

  double quantum() const;
  /// Of voxel number `voxel` of the plane.
  double value(const EncodedPlane& plane, std::size_t voxel) const;
};

/// What a job promises of a channel, in its unit: the strictest of the planes that show it and of the maps that read
/// it. Infinite if none does.
double tolerance_of(const SolidSummary& solid, const SliceJob& job, std::uint32_t channel);

/// The channels of one plane of a job.
std::vector<ChannelSamples> samples_of(const LimitSolid& solid, const SliceJob& job, const PlaneSpec& plane);

}  // namespace ccslice::oracle
