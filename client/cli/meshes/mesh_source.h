// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Where a command's mesh comes from: a file (Gmsh, Abaqus, Exodus, MEDIT, VTK, OpenVolumeMesh, .ccmesh, JSON),
// sharpened, fitted, sized and graded on the way, or the id of a mesh that the server holds.
//
// What is said of a file's vertices and cells, here or by the server, is said in the file's own numbers.

#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/meshes/merging.h"
#include "client/cli/meshes/mesh_meaning.h"
#include "client/cli/meshes/sizing.h"
#include "client/cli/options/placement.h"
#include "client/cli/session/session.h"
#include "client/mesh_bytes.h"
#include "core/mesh/connected_parts.h"
#include "core/mesh/control_mesh.h"
#include "core/mesh/validate.h"
#include "core/mesh_import/mesh_file.h"

namespace ccslice::cli {

struct MeshOptions {
  std::string mesh;
  std::vector<std::string> grades = {};
  SizeOptions size = {};
  MeaningOptions meaning = {};
  MergeOptions merge = {};
  bool allow_folds = false;
  std::string allow_includes = {};  // A folder.
  std::uint64_t max_file_bytes = 8ull << 30;
  std::string regions_from = {};            // Numbers or sets of cells in the file.
  std::vector<std::string> cell_data = {};  // NAME=average.
  std::vector<std::string> leave_out = {};  // Channels.
  Vec3 scale = Vec3::Ones();                // What --scale does later: lengths are those of the printed size.
};

/// MESH may be left out unless it is required, and is a file or, unless the command takes files only, a mesh's id.
void add_mesh_options(CLI::App& command, MeshOptions& options, bool required = true, bool files_only = false);

struct LoadedMesh {
  ControlMesh mesh;
  FileNumbers numbers;
  MeshReport report;
  ConnectedParts parts;
  std::vector<std::string> warnings;
  std::shared_ptr<const client::MeshBytes> bytes;
};

/// Reads, checks, sharpens, fits, sizes and grades a file. Unless `quiet`, a line on standard error comes before what
/// takes long. Throws Error (1xx, 4xx) with the file's name in front.
LoadedMesh load_mesh(const MeshOptions& options, bool quiet = true);

/// Notes on what was read and changed: lines on standard error, unless the session is quiet.
void print_notes(const Session& session, const LoadedMesh& mesh);

/// Whether the options make another mesh of what is in the file.
bool change_mesh(const MeshOptions& options);

/// Whether the options name a mesh on the server rather than a file. Throws UsageError if it is to be changed.
bool names_mesh_id(const MeshOptions& options);

/// The id of the mesh, on the server by the time this returns: files are loaded and uploaded where they are missing.
std::string ensure_on_server(Session& session, MeshOptions options, const PlacementOptions& placement = {});

/// Uploads a loaded mesh, with a progress bar, if the server lacks it.
client::UploadOutcome upload(Session& session, const LoadedMesh& mesh);

}  // namespace ccslice::cli
