// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Jobs that the slicer's tests share.

#pragma once

#include <cstdint>
#include <memory>

#include "core/limit/limit_solid.h"
#include "core/slicer/layer_slicer.h"

namespace ccslice {

using Solid = std::shared_ptr<const LimitSolid>;

inline constexpr double kOutsideMm = 2e-3;  // As LayerSlicer has it with the default contour tolerance.

inline PlaneSpec occupancy() {
  PlaneSpec plane;
  plane.encoding = Encoding::kRaw;
  return plane;
}

/// `index`: of the solid's channels.
inline PlaneSpec channel(const Solid& solid, std::uint32_t index, SampleType type, Encoding encoding = Encoding::kRaw) {
  PlaneSpec plane;
  plane.content = PlaneContent::kChannel;
  plane.channel = solid->summary().channels[index].name;
  plane.sample_type = type;
  plane.encoding = encoding;
  return plane;
}

inline SliceJob job_of(const Solid& solid, const VoxelPitch& pitch,
                       const Placement& placement = Placement::Identity()) {
  SliceJob job;
  job.placement = placement;
  GridRequest request;
  request.pitch = pitch;
  job.grid = plan_grid(*solid, placement, request);
  job.planes = {occupancy(), channel(solid, 0, SampleType::kFloat32)};
  return job;
}

}  // namespace ccslice
