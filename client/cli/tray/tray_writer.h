// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Parts of a job as a 3MF package that other programs arrange: an object for each mesh, a build item for each
// placement, in millimeters [3MF, 3.4.3.1, 4.1].

#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "client/surface.h"
#include "core/base/types.h"

namespace ccslice::cli {

struct TrayObject {
  std::string name;
  client::Surface surface;            // In the mesh's frame.
  std::vector<Placement> placements;  // At least one.
};

/// Returns the file's size. Throws Error{kFileUnwritable}.
std::uint64_t write_tray(const std::vector<TrayObject>& objects, const std::filesystem::path& path);

}  // namespace ccslice::cli
