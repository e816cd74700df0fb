// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Cell regions of hostile meshes: which cells they are of, and channels that jump between them. They are drawn from
// streams of their own, so a mesh without regions stays what its seed stands for.

#pragma once

#include <cstdint>

#include "core/mesh/control_mesh.h"
#include "tests/oracle/hostile/hostile_mesh.h"

namespace ccslice::oracle {

/// Gives about a third of the seeds' meshes named cell regions: bands along an axis, cells about random centres, one
/// cell alone, a region for each cell at random, or a single one. Some names have no cells. Half of them get channels
/// that jump at interfaces. A mesh that has regions keeps them.
void add_hostile_regions(std::uint64_t seed, HostileMesh& mesh);

/// The mesh with one more channel, the last: the number of the cell region. So the channel of a voxel tells the region
/// of the cell that its parameter is in. REQUIRES: cell regions.
ControlMesh with_region_channel(const ControlMesh& mesh);

}  // namespace ccslice::oracle
