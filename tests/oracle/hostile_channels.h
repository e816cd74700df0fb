// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of hostile meshes.

#pragma once

#include <string>

#include "core/mesh/control_mesh.h"
#include "tests/oracle/hostile_random.h"

namespace ccslice::oracle {

/// Replaces the mesh's channels by one to three random ones, each smooth, linear in the position, random by vertex,
/// constant, constant but for one vertex, or steep across a cell. Returns what they are.
std::string add_hostile_channels(HostileRandom& random, ControlMesh& mesh);

}  // namespace ccslice::oracle
