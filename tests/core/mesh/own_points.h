// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>

#include "core/mesh/control_mesh.h"

namespace ccslice {

/// The mesh with points of its own for each cell; their channels are those of the mesh.
inline ControlMesh with_own_points(const ControlMesh& mesh) {
  ControlMesh own = mesh;
  own.positions.clear();
  own.channel_values.clear();
  const auto channels = static_cast<std::ptrdiff_t>(mesh.channel_count());
  for (std::uint32_t& v : own.cell_vertices) {
    own.positions.push_back(mesh.positions[v]);
    const auto values = mesh.channel_values.begin() + static_cast<std::ptrdiff_t>(v) * channels;
    own.channel_values.insert(own.channel_values.end(), values, values + channels);
    v = static_cast<std::uint32_t>(own.positions.size() - 1);
  }
  return own;
}

}  // namespace ccslice
