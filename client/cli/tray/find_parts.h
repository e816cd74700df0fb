// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which of a package's meshes are parts of a job, and where they lie. Programs move the origin of what they read, drop
// names and number objects anew, but keep the vertices in their order: PrusaSlicer 2.5 and later and Bambu Studio take
// each of them as floats and write floats in 9 digits (%.9g), which are floats again [Prusa, _generate_volumes(),
// format_coordinate(); Bambu]. So a part is known by the number of its vertices and by where each of them is, and its
// placement is the motion that takes the vertices as they were exported to those of the file.
//
// Rounding stays: a coordinate of up to 512 mm is half of 2^-15 mm off as a float, twice (as it is read, and once the
// middle of the part is made its origin): 0.03 um. Matrices have 9 digits: 0.5e-9 of a part's size, and 0.5 nm of up to
// 1 m. kMostResidualMm is 1 um: some thirty times that, and a tenth of what anybody can print.

#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/tray/tray_package.h"
#include "core/base/types.h"

namespace ccslice::cli {

/// The farthest that a vertex may be from where a motion takes it, mm.
inline constexpr double kMostResidualMm = 0.001;

/// A part as it was exported.
struct ExportedPart {
  std::string name;
  std::vector<Vec3> points;   // In the mesh's frame.
  std::vector<Mat3> linears;  // Linear parts of the job's placements: a part may be scaled already. At least one.
};

struct FoundPart {
  std::size_t part = 0;
  Placement placement = Placement::Identity();  // Of the mesh, in the file's world frame.
  double residual_mm = 0;
  bool mirrored = false;  // Against the job's own placement.
};

/// The part that an instance is, or why it is none.
struct PartSearch {
  std::optional<FoundPart> found;
  bool is_foreign = false;  // It has nothing of the job's parts. Otherwise it was changed.
  std::string fault;        // "object 3 'ring' is scaled by 2 x 1 x 1: ...".
  std::string remedy;       // What to do about it, which may be the same for several.
};

/// REQUIRES: parts without points that are no numbers.
PartSearch find_part(const std::vector<ExportedPart>& parts, const TrayInstance& instance);

}  // namespace ccslice::cli
