// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// One number for layers: FNV-1a of 64 bits over their planes' checksums, statistics and contours.

#pragma once

#include <bit>
#include <cstdint>

#include "core/job/slice_job.h"

namespace ccslice::bench {

class LayerDigest {
 public:
  void add(std::uint64_t number) {
    for (int byte = 0; byte < 8; ++byte, number >>= 8) hash_ = (hash_ ^ (number & 0xff)) * 0x100000001b3;
  }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
  void add(const Layer& layer) {
    add(std::uint64_t{layer.index});
    const LayerStats& stats = layer.stats;
    for (const std::uint64_t count :
         {stats.voxels_inside, stats.voxels_coherent, stats.voxels_full, stats.voxels_interpolated,
          stats.voxels_repainted, stats.voxels_unresolved, stats.contour_loops, stats.contour_points}) {
      add(count);
    }
    add(stats.max_residual_mm);
    for (const std::uint64_t count : stats.material_voxels) add(count);
    for (const EncodedPlane& plane : layer.planes) add(std::uint64_t{plane.crc32});
    for (const auto& loop : layer.contours.loops) {
      for (const ContourPoint& point : loop.points) {
        add(point.xy.x());
        add(point.xy.y());
      }
    }
  }
  std::uint64_t value() const { return hash_; }

 private:
  std::uint64_t hash_ = 0xcbf29ce484222325;
};

}  // namespace ccslice::bench
