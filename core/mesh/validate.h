// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Whether a control mesh is a solid that can be subdivided: every face in one or two cells, every vertex surrounded by
// a ball or a half-ball of cells, none of them inside out. What is wrong is named with its ids.
//
// Cells of an interpolating mesh may be inside out without the limit being so anywhere. Only their order of corners is
// checked, against their neighbours'; where the limit folds, preparing it tells.

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/mesh/cell_complex.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/validate.h"

namespace ccslice {

/// What a control mesh may hold at most. Checked before anything proportional to it is allocated.
struct MeshLimits {
  std::size_t max_vertices = 16'000'000;
  std::size_t max_cells = 8'000'000;
  std::size_t max_channels = 64;
  std::size_t max_channel_name_bytes = 256;
  std::size_t max_cell_regions = 255;
  std::size_t max_cell_region_name_bytes = 256;
  double max_abs_coordinate_mm = 1e6;
  std::uint32_t max_edge_valence = 64;     // Cells round one edge.
  std::uint32_t max_vertex_valence = 256;  // Cells round one vertex.
};

/// What validation found that doesn't refuse the mesh.
struct MeshReport {
  std::vector<std::uint32_t> inverted_cells;  // With allow_folds only: cells with a corner of non-positive Jacobian.
};

/// Checks every rule of a control mesh and reorients cells whose corners are all negative (mirrored corner order).
/// Throws Error (1xx) naming the offending ids, and Error{kCancelled}. `mesh` is unchanged if it throws.
MeshReport validate(ControlMesh& mesh, const MeshLimits& limits = {}, const CancellationToken& cancel = {});

/// A mesh's report and the complex of its cells, reoriented.
struct ConnectedMesh {
  MeshReport report;
  CellComplex complex;
};

/// validate(), for those who need the complex as well.
ConnectedMesh validate_and_connect(ControlMesh& mesh, const MeshLimits& limits, const CancellationToken& cancel);

}  // namespace ccslice
