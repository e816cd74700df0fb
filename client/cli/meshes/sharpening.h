// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The options that keep edges sharp (core/mesh_authoring/sharpen.h).

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::cli {

struct SharpOptions {
  std::optional<double> angle_deg = std::nullopt;
  bool reentrant = false;
  std::string file = {};

  bool any() const { return angle_deg || !file.empty(); }
};

void add_sharp_options(CLI::App& command, SharpOptions& options);

/// Tags what the list of sharp features names, by the vertices that the file has: so before points are joined. Throws
/// Error{kFileUnreadable, kFileSyntax}.
void sharpen_listed(const SharpOptions& options, ControlMesh& mesh);

/// Tags the rest of `mesh` as the options say, and adds sentences on what was tagged to `notes`. Says whether there are
/// edges among it that aren't convex, at which cells often fold. `checked` is the same mesh as validate() left it.
/// Throws UsageError.
bool sharpen_by_angle(const SharpOptions& options, const ControlMesh& checked, ControlMesh& mesh,
                      std::vector<std::string>& notes);

}  // namespace ccslice::cli
