// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Material channels one by one, as files and grades have them, and into a control mesh, which has them vertex by
// vertex.

#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice {

struct NamedChannel {
  std::string name;
  std::vector<float> values;  // One for each vertex.
};

/// Empty channels for an array of so many components: "name", or "name.0", "name.1", ... where there are several.
std::vector<NamedChannel> open_channels(const std::string& name, std::size_t components);

/// Adds them behind the channels that the mesh has. Throws Error{kFileSyntax} if one hasn't a value for each vertex.
void append_channels(std::span<const NamedChannel> channels, ControlMesh& mesh);

}  // namespace ccslice
