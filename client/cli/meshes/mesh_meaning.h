// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The meaning of a mesh. Without an option it is a control mesh, designed as one. --as-meshed takes it as it is, as
// finite elements do (ControlMesh::as_meshed). --part says that it was made of a part: edges that turn by 40 degrees
// are kept sharp, and control points are fitted, so that the limit passes through the mesh's vertices. Where that
// fails, a part is taken as meshed.

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/meshes/fitting.h"
#include "client/cli/meshes/sharpening.h"
#include "core/mesh/control_mesh.h"

namespace ccslice::cli {

struct MeaningOptions {
  bool as_meshed = false;
  bool part = false;
  bool smooth = false;  // Fitting may round edges.
  SharpOptions sharp = {};
  std::string fit = {};   // "", "all" or "boundary".
  double voxel_mm = 0.1;  // The smallest side of the voxels that are asked for, or a usual one.

  bool any() const { return as_meshed || part || smooth || sharp.any() || !fit.empty(); }
};

void add_meaning_options(CLI::App& command, MeaningOptions& options);

/// Returns what the options say of fitting. Throws UsageError for options that contradict each other.
std::optional<FittedVertices> parse_meaning(const MeaningOptions& options);

/// Has `mesh` taken as meshed, or as a control mesh, which has no mid-nodes: then a note says how many are left out.
void take_as(bool as_meshed, ControlMesh& mesh, std::vector<std::string>& notes);

/// Sharpens and fits a mesh of a part, which comes as meshed. Nothing if that doesn't give the part: then it stays so,
/// and the notes say why. REQUIRES: a mesh that validate() takes.
std::optional<FittedMesh> fit_part(const MeaningOptions& options, const Vec3& scale, ControlMesh& mesh, bool quiet,
                                   std::vector<std::string>& notes);

/// Throws Error{kMeshNotInterpolable} where the fit rounds edges that turn by 75 degrees or more, unless --smooth says
/// that it may.
void refuse_rounded_edges(const MeaningOptions& options, const FittedMesh& fitted);

}  // namespace ccslice::cli
