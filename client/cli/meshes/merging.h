// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The options that say which points of a file are one (core/mesh_import/join_points.h), and what becomes of places
// where the mesh touches itself (core/mesh_import/split_touching.h): points are joined first, then what still touches
// is split.

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "core/mesh/connected_parts.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

struct MergeOptions {
  std::string merge_points = {};  // A distance in mm.
  bool no_merge = false;
  bool no_split = false;

  bool any() const { return !merge_points.empty() || no_merge || no_split; }
};

void add_merge_options(CLI::App& command, MergeOptions& options);

/// Throws UsageError.
void check_merge_options(const MergeOptions& options);

/// same_place_mm() and last_digit_mm() of the file's own numbers, in mm of the mesh.
struct SamePlace {
  double mm = 0;
  double last_digit_mm = 0;
};

/// Joins points of the file as the options say, and adds sentences on that to the file's warnings. Points that differ
/// in the last digit are joined only if that harms no cell and no value. Meshes of the contract have the points that
/// are meant, so theirs are joined only on demand. Says where parts look like one. Says whether anything is joined.
/// Throws what join_points() does, with the options that help. REQUIRES: a mesh that passes check_arrays(), but for its
/// positions and values, or one that a reader made.
bool merge_points(const MergeOptions& options, bool is_contract, const SamePlace& same, MeshFile& file);

/// validate_and_connect() of `checked`, a copy of `mesh`. Where the mesh touches itself both are split first, unless
/// the options forbid it, and a sentence on that goes to `notes`. `was_split` says whether.
ConnectedMesh validate_split(const MergeOptions& options, ControlMesh& checked, ControlMesh& mesh, FileNumbers& numbers,
                             std::vector<std::string>& notes, bool& was_split);

}  // namespace ccslice::cli
