// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/surface_mesh.h"

#include <algorithm>

namespace ccslice {

std::array<std::uint32_t, 4> SurfaceVertices::enter_middles(const SurfaceBox& box) {
  const std::uint32_t half = box.size / 2;
  return {insert(box.face, box.s + half, box.t).first, insert(box.face, box.s + box.size, box.t + half).first,
          insert(box.face, box.s + half, box.t + box.size).first, insert(box.face, box.s, box.t + half).first};
}

void SurfaceVertices::enter_coarser_middles(BoundaryFaceId face, std::vector<std::uint32_t>& middles) {
  for (const FaceSide& side : surface_.faces_and_interfaces()[face].sides) {
    std::uint32_t begin = std::min(side.t_begin, side.t_end);
    std::uint32_t length = std::max(side.t_begin, side.t_end) - begin;
    for (; length < kSurfaceOne; length *= 2) {
      begin -= begin % (2 * length);
      middles.push_back(table_.insert({SurfaceKey::Kind::kEdge, side.edge, begin + length, 0}).first);
    }
  }
}

}  // namespace ccslice
