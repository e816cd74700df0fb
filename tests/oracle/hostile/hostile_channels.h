// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Materials of hostile meshes.

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "tests/oracle/hostile/hostile_random.h"

namespace ccslice::oracle {

/// A channel that is linear in the position of the control points is so in the whole limit, wherever its parameters
/// are.
struct LinearMaterial {
  Vec3 slope = Vec3::Zero();  // Per mm, mesh frame.
  double base = 0;
  double operator()(const Vec3& point) const { return base + slope.dot(point); }
};

struct HostileChannels {
  std::string description;
  std::vector<std::optional<LinearMaterial>> linear;  // By channel.
};

/// Replaces the mesh's channels by one to three random ones, each smooth, linear in the position, random by vertex,
/// constant, constant but for one vertex, or steep across a cell.
HostileChannels add_hostile_channels(HostileRandom& random, ControlMesh& mesh);

}  // namespace ccslice::oracle
