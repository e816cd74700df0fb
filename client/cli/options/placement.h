// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How a part lies in the printer: scaled first, then rotated in the order given, then moved, all about the mesh's
// origin.

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "ccslice/v1/geometry.pb.h"
#include "core/base/types.h"

namespace ccslice::cli {

struct PlacementOptions {
  std::string scale;                // "2" or "1,1,-1".
  std::vector<std::string> rotate;  // "x=90", degrees.
  std::string translate;            // "10,0,0", mm.
};

void add_placement_options(CLI::App& command, PlacementOptions& options);

/// What --scale multiplies x, y and z by; negative where it mirrors. Throws UsageError.
Vec3 parse_scale(const PlacementOptions& options);

/// Throws UsageError. Multiples of 90 degrees give exact matrices.
v1::Placement parse_placement(const PlacementOptions& options);

}  // namespace ccslice::cli
