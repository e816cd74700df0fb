// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The options that keep edges sharp (core/mesh/sharpen.h).

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

/// Tags `mesh` as the options say, and adds sentences on what was tagged, and may fold, to `notes`. `checked` is the
/// same mesh as validate() left it. Throws UsageError, and Error{kFileUnreadable, kFileSyntax} for a file of sharp
/// features.
void sharpen(const SharpOptions& options, const ControlMesh& checked, ControlMesh& mesh,
             std::vector<std::string>& notes);

}  // namespace ccslice::cli
