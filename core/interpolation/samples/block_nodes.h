// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A BLOCK is a box of a cell's parameters, or the curved hexahedron that it is mapped to, seen at 5 x 5 x 5 nodes: node
// (i, j, k) has the index i + 5 (j + 5 k).

#pragma once

#include <array>
#include <cstddef>

#include "core/base/types.h"

namespace ccslice {

inline constexpr std::size_t kBlockNodes = 5;  // Along an axis.

/// From a node to the next one along each axis.
inline constexpr std::array<std::size_t, 3> kBlockStride = {1, kBlockNodes, kBlockNodes* kBlockNodes};

inline constexpr std::size_t kBlockPoints = kBlockNodes * kBlockNodes * kBlockNodes;
using BlockPoints = std::array<Vec3, kBlockPoints>;

}  // namespace ccslice
