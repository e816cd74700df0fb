// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A random control mesh from a seed: bars, plates, struts, rings, fans, balls, mixed cells, refined ones, ..., bent,
// twisted, stretched and jittered, with sharp edges and corners, of any size, anywhere, and with materials that are
// smooth, random, steep or constant. hostile_meshed.h takes some as meshed,
// hostile_regions.h adds cell regions.

#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "tests/oracle/hostile/hostile_channels.h"

namespace ccslice::oracle {

/// A mesh that is there already, from a file.
struct NamedMesh {
  std::string name;
  ControlMesh mesh;
};

struct HostileMesh {
  ControlMesh mesh;
  std::string description;                            // In one line.
  std::vector<std::optional<LinearMaterial>> linear;  // By channel.
};

/// Not always valid: cells may be inverted, pieces may touch at a vertex or an edge only. `files`: if there are any,
/// the shape of one of them instead of a made one.
HostileMesh make_hostile_mesh(std::uint64_t seed, std::span<const NamedMesh> files = {});

}  // namespace ccslice::oracle
