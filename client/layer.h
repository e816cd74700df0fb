// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A layer as it reaches the caller: complete and checked.

#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "ccslice/v1/plan.pb.h"
#include "ccslice/v1/slice.pb.h"

namespace ccslice::client {

struct Plane {
  v1::PlaneSpec spec;   // With defaults filled in, as the server reported it.
  std::string encoded;  // As it travelled: a picture file, a zstd frame, or the samples themselves.
  std::string samples;  // Decoded, size and CRC-32 checked: rows of samples as in PLANE_ENCODING_RAW. Empty for
                        // pictures, which are passed through.
  v1::PlaneResult result;
};

/// Closed: the last point joins the first.
struct ContourLoop {
  std::vector<double> points_mm;     // x, y of every point, world frame.
  std::vector<std::uint32_t> faces;  // Boundary face of every point; empty of contours by region.
  std::vector<double> parameters;    // s, t of every point on its face; likewise.
  std::uint32_t cell_region = 0;     // Of contours by region: 1 + its index in SliceHeader.cell_region_names.
  std::uint32_t placed_part = 0;     // As in ContourPiece.
};

struct Layer {
  std::uint32_t index = 0;
  double z_mm = 0;
  std::vector<Plane> planes;  // In the order of the request.
  std::vector<ContourLoop> contours;
  v1::LayerEnd end;  // Counts and statistics.
};

/// What the layers of a job hold: the whole grid, if the server doesn't say.
v1::VoxelBox region_of(const v1::SliceHeader& header);
v1::VoxelBox region_of(const v1::PlanSlicesResponse& plan);

/// Bytes of a decoded plane on a grid. REQUIRES: a sample type other than UNSPECIFIED.
std::uint64_t sample_bytes(const v1::PlaneSpec& spec, const v1::GridExtent& extent);

}  // namespace ccslice::client
