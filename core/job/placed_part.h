// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of a job: placed solids that share a grid, planes and materials.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/job/slice_job.h"
#include "core/limit/limit_solid.h"
#include "core/raster/layer_window.h"

namespace ccslice {

/// One placed solid, and what of it is asked for. Channels and cell regions of its job are the solid's own.
struct PlacedPart {
  std::string name;  // For messages.
  std::shared_ptr<const LimitSolid> solid;
  SliceJob job;
  // Voxels in several parts are of the one with the highest priority, and of those of the first one.
  std::int32_t priority = 0;
  bool is_copy = false;  // All but its placement is that of the part before it.
};

/// The placements are equal, but for where they move to.
inline bool lie_alike(const Placement& a, const Placement& b) { return a.linear() == b.linear(); }

inline constexpr std::size_t kMaxPlacedParts = 4096;

/// At least one, at most kMaxPlacedParts. REQUIRES of several: validate_job() passes for each; grid, region, order,
/// planes' sample types, encodings and outside samples, materials, background, and what is asked for of contours and
/// overlaps are the same in all; integer planes of channels have a range, the same in all; no more than 255
/// cell_region_names().
using PlacedParts = std::vector<PlacedPart>;

/// The columns and rows of the grid that the solid may be in.
LayerWindow window_of_solid(const SolidSummary& solid, const SliceJob& job);

/// The smallest window that holds those of all parts.
LayerWindow window_of_parts(const PlacedParts& parts);

/// Bytes of a layer's samples, encoded: of the solid's window for encodings that leave out what is outside, else of all
/// of the region.
std::uint64_t most_layer_bytes(const SolidSummary& solid, const SliceJob& job);
/// Of all parts.
std::uint64_t most_layer_bytes(const PlacedParts& parts);

/// The names of all parts' cell regions, each once, in the order in which parts come. Layers number cell regions so.
std::vector<std::string> cell_region_names(const PlacedParts& parts);

}  // namespace ccslice
