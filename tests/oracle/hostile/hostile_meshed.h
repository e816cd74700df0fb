// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A third of all hostile meshes are taken as meshed, and many of these have curved cells.

#pragma once

#include <cstdint>

#include "tests/oracle/hostile/hostile_mesh.h"

namespace ccslice::oracle {

/// Draws from a stream of its own. REQUIRES: the mesh has its channels, and no regions yet.
void take_some_as_meshed(std::uint64_t seed, HostileMesh& mesh);

}  // namespace ccslice::oracle
