// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The faces of a block (interpolation/samples/block_nodes.h), as quadrilaterals between every step-th node.

#pragma once

#include <cstddef>

#include "core/interpolation/samples/block_nodes.h"

namespace ccslice {

/// The nodes of a face: where an axis is 0, or at its end.
struct BlockFace {
  std::size_t origin, along_s, along_t;

  BlockFace(std::size_t axis, std::size_t side)
      : origin(side * (kBlockNodes - 1) * kBlockStride[axis]),
        along_s(kBlockStride[(axis + 1) % 3]),
        along_t(kBlockStride[(axis + 2) % 3]) {}
  std::size_t node(std::size_t s, std::size_t t) const { return origin + s * along_s + t * along_t; }
};

/// Calls visit(s, t) for the lower corner of each quadrilateral of a face.
template <typename Visit>
void for_each_quad(std::size_t step, Visit visit) {
  for (std::size_t t = 0; t + 1 < kBlockNodes; t += step) {
    for (std::size_t s = 0; s + 1 < kBlockNodes; s += step) visit(s, t);
  }
}

}  // namespace ccslice
