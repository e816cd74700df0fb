// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The option that fits control points to a mesh that was made as a part (core/vertex_fit/vertex_fit.h).

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/meshes/sizing.h"
#include "core/mesh/control_mesh.h"
#include "core/vertex_fit/vertex_fit.h"

namespace ccslice::cli {

/// Adds --fit.
void add_fit_option(CLI::App& command, std::string& fit);

/// "", "all" or "boundary". Throws UsageError.
std::optional<FittedVertices> parse_fit(const std::string& fit);

/// A mesh whose control points are fitted, together with the mesh that its limit passes through, while both are
/// changed: what has to do with the part, such as grades, is done to the latter.
class FittedMesh {
 public:
  /// Fits the positions. Throws what VertexFit does. Unless quiet, shows its progress, as finish() does.
  FittedMesh(const ControlMesh& mesh, FittedVertices vertices, bool quiet);
  /// Takes a mesh that was fitted before.
  FittedMesh(const ControlMesh& fitted, bool quiet);

  const ControlMesh& fitted() const { return fitted_; }
  /// On the positions. Empty if the mesh was fitted before.
  const FitReport& report() const { return report_; }
  ControlMesh& meant() { return meant_; }
  /// Scales and moves both.
  void place(const Similarity& similarity);
  /// The fitted mesh with the channels of the one that is meant, fitted too. Adds sentences on how well all that went
  /// to `notes`, whose lengths are those once `scale` has scaled the mesh further.
  ControlMesh finish(const Vec3& scale, std::vector<std::string>& notes);

 private:
  VertexFit fit_;
  std::optional<FittedVertices> vertices_;  // None if the mesh was fitted before.
  FitReport report_;
  ControlMesh fitted_, meant_;
};

}  // namespace ccslice::cli
