// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How many parts a mesh falls into. Parts have no vertex in common, wherever they lie.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

struct ConnectedParts {
  std::size_t count = 0;
  std::size_t of_one_cell = 0;
};

/// REQUIRES: the cells' vertices exist.
ConnectedParts count_parts(const ControlMesh& mesh);

/// How far points of different parts are apart that ought to be one, as they look: no more than `most_mm`, which is
/// small beside the cells. Joining points within `apart_mm` leaves so many parts. REQUIRES: as above.
struct NearParts {
  double apart_mm = 0;
  std::size_t count = 0;
};
NearParts find_near_parts(const ControlMesh& mesh, double most_mm);

}  // namespace ccslice
