// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Meshes with cell regions, and each region as a mesh of its own, made by counting faces and without the core.

#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

/// The region of a cell by the mean of its corners.
using RegionAt = std::function<int(const Vec3&)>;

/// The mesh with `count` regions, called r0, r1 and so on.
ControlMesh with_regions(ControlMesh mesh, int count, const RegionAt& region_at);

/// The channels' values of a vertex in a region.
using RegionValuesAt = std::function<std::vector<float>(std::uint32_t vertex, std::uint8_t region)>;

/// The mesh with these channels, whose values jump across interfaces where `values_at` does.
ControlMesh with_jumping_channels(ControlMesh mesh, const std::vector<std::string>& names,
                                  const RegionValuesAt& values_at);

/// The cells of one region, with its own vertices and sharp features as core/mesh/cell_regions.h has them. REQUIRES: no
/// two cells of the region touch in a vertex or edge without being joined by faces there.
ControlMesh region_as_mesh(const ControlMesh& mesh, int region);

/// Meshes of several regions: layers, junctions of three and more, nested ones, a region of two pieces, tetrahedra and
/// wedges, sharp edges. All satisfy region_as_mesh().
struct RegionMesh {
  std::string name;
  ControlMesh mesh;
};
const std::vector<RegionMesh>& region_meshes();

}  // namespace ccslice::oracle
