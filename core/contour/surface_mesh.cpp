// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/contour/surface_mesh.h"

#include <algorithm>

namespace ccslice {

void SurfaceVertices::enter_face(std::uint32_t face) {
  for (const FaceSide& side : surface_.faces()[face].sides) {
    std::uint32_t begin = std::min(side.t_begin, side.t_end);
    std::uint32_t length = std::max(side.t_begin, side.t_end) - begin;
    for (; length < kSurfaceOne; length *= 2) {
      begin -= begin % (2 * length);
      table_.insert({SurfaceKey::Kind::kEdge, side.edge, begin + length, 0});
    }
  }
}

void SurfaceVertices::enter_halving(const SurfaceBox& box) {
  const std::uint32_t half = box.size / 2;
  insert(box.face, box.s + half, box.t);
  insert(box.face, box.s + box.size, box.t + half);
  insert(box.face, box.s + half, box.t + box.size);
  insert(box.face, box.s, box.t + half);
}

}  // namespace ccslice
