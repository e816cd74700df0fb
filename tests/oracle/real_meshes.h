// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Real meshes that aren't part of the repository (CCSLICE_SHARED_MESHES_DIR). Tests skip where they are absent.
// The samples that the core makes, and fixtures of the repository, stand beside them and are always there.

#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/mesh/control_mesh.h"

namespace ccslice::oracle {

/// File names of the meshes that must be accepted.
const std::vector<std::string>& real_mesh_names();
/// Two of them that take moments; one has wedges and tetrahedra.
const std::vector<std::string>& small_real_mesh_names();
/// Those that have edges with one hex.
const std::vector<std::string>& real_meshes_with_convex_edges();

/// The samples of core/models/models.h, and meshes of tests/data/meshes: of tetrahedra, as programs make them from CAD;
/// with further files that the environment names (CCSLICE_TETRAHEDRA, paths with a colon between), as the nightly tests
/// make them. The functions below take their names too.
const std::vector<std::string>& sample_names();
const std::vector<std::string>& fixture_names();

/// Graded by coordinates (channels x, y, z) and by the distance from the middle ("radius"), unless the file brings
/// channels of its own. Nothing if the file isn't there.
std::optional<ControlMesh> read_real_mesh(const std::string& name);
/// As it is in the file.
std::optional<ControlMesh> read_real_mesh_ungraded(const std::string& name);

/// Scales about the origin until the control points' box has this longest side.
void scale_to(double longest_mm, ControlMesh& mesh);

/// A test case's name: letters, digits and underscores only.
std::string case_name(const std::string& mesh_name);

}  // namespace ccslice::oracle
