// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Material channels one by one, as files and grades have them, and into a control mesh, which has them vertex by
// vertex.

#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice {

struct NamedChannel {
  std::string name;
  std::vector<float> values;  // One for each vertex.
  std::vector<float>
      mid_values{};  // One for each of the mesh's mid-nodes, or none: then these have their corners' means.
};

/// What component `i` of an array is called: "name", or "name.0", "name.1", ... where there are several.
std::string component_name(const std::string& name, std::size_t components, std::size_t i);

/// Empty channels for an array of so many components.
std::vector<NamedChannel> open_channels(const std::string& name, std::size_t components);

/// Adds a file's channels to its mesh. Those with names that no mesh may have (empty, too long, or taken) are left out
/// with a note. Throws Error{kFileSyntax} as append_channels().
void append_file_channels(std::vector<NamedChannel> channels, const MeshLimits& limits, MeshFile& file);

/// The smallest and the largest value of a channel at vertices, in all regions, and mid-nodes. REQUIRES: there are
/// vertices.
std::array<float, 2> channel_range(const ControlMesh& mesh, std::size_t channel);

/// Adds them behind the channels that the mesh has; they don't jump across interfaces. Throws Error{kFileSyntax} if one
/// hasn't a value for each vertex.
void append_channels(std::span<const NamedChannel> channels, ControlMesh& mesh);

/// Removes a channel, or all components of an array (component_name()) if no channel has just that name. Throws
/// Error{kMeshBadChannel}, with the names that there are, if the mesh has none of them.
void leave_out_channel(const std::string& name, ControlMesh& mesh);

}  // namespace ccslice
