// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/mesh_source.h"

#include <utility>

#include "client/cli/ccmesh.h"
#include "client/cli/console.h"
#include "client/cli/json.h"
#include "client/cli/mesh_convert.h"
#include "client/cli/text_values.h"
#include "core/base/error.h"
#include "core/mesh/grade.h"
#include "core/mesh/mesh_file.h"

namespace ccslice::cli {
namespace {

constexpr std::uint64_t kMaxFileBytes = 8ull << 30;

void check_channel_names(const ControlMesh& mesh) {
  for (const std::string& name : mesh.channel_names) {
    if (!is_utf8(name)) throw Error(ErrorCode::kMeshBadChannel, "a channel name is not UTF-8", "channel_names");
  }
}

MeshFile read_any(const std::string& bytes) {
  if (mesh_file_kind(bytes) != MeshFileKind::kUnknown) return read_mesh(bytes);
  return {from_proto(parse_ccmesh(bytes)), {}};
}

/// Grades and sharpens the mesh, which must be valid before and is checked again afterwards.
void change(const MeshOptions& options, const std::vector<Grade>& grades, LoadedMesh& loaded) {
  ControlMesh checked = loaded.mesh;
  validate(checked);
  for (const Grade& grade : grades) apply_grade(grade, loaded.mesh);
  sharpen(options.sharp, checked, loaded.mesh, loaded.warnings);
  check_channel_names(loaded.mesh);
}

LoadedMesh load(const MeshOptions& options, const std::vector<Grade>& grades) {
  std::string bytes = read_file_bytes(options.mesh, kMaxFileBytes);
  const bool ccmesh = mesh_file_kind(bytes) == MeshFileKind::kUnknown && !is_json(bytes);
  MeshFile file = read_any(bytes);
  LoadedMesh loaded;
  loaded.mesh = std::move(file.mesh);
  loaded.warnings = std::move(file.warnings);
  // A .ccmesh that is taken as it is keeps its bytes, and so its id.
  const bool allow_folds = loaded.mesh.allow_folds || options.allow_folds;
  const bool changed = !grades.empty() || options.sharp.any();
  const bool as_it_is = ccmesh && !changed && loaded.mesh.allow_folds == allow_folds;
  loaded.mesh.allow_folds = allow_folds;
  check_channel_names(loaded.mesh);
  if (changed) change(options, grades, loaded);
  ControlMesh checked = loaded.mesh;
  loaded.report = validate(checked);
  loaded.bytes = std::make_shared<const client::MeshBytes>(
      as_it_is ? client::MeshBytes::from_serialized(std::move(bytes)) : client::MeshBytes(to_proto(loaded.mesh)));
  return loaded;
}

}  // namespace

void add_mesh_options(CLI::App& command, MeshOptions& options, bool required) {
  command
      .add_option("MESH", options.mesh,
                  "A MEDIT .mesh, legacy VTK, OpenVolumeMesh .ovm, .ccmesh or its .json file, or the id of an uploaded "
                  "mesh (sha256:...)")
      ->required(required);
  command
      .add_option(
          "--grade", options.grades,
          "Add a material channel: NAME=x|y|z[:A..B] along an axis, NAME=radial[:x|y|z][:A..B][:@X,Y,Z] away from "
          "an axis or a point, NAME=distance[:A..B][:DEPTH] from the boundary inwards, NAME=file:PATH one value for "
          "each vertex. May be repeated")
      ->allow_extra_args(false)
      ->group("Mesh");
  add_sharp_options(command, options.sharp);
  command
      .add_flag("--allow-folds", options.allow_folds, "Accept inverted cells with a warning instead of refusing them")
      ->group("Mesh");
}

LoadedMesh load_mesh(const MeshOptions& options) {
  std::vector<Grade> grades;
  try {
    for (const std::string& text : options.grades) grades.push_back(parse_grade(text));
  } catch (const Error& error) {
    throw UsageError(error.what());
  }
  try {
    return load(options, grades);
  } catch (const Error& error) {
    if (error.code() == ErrorCode::kFileUnreadable) throw;
    const char* remedy = error.code() == ErrorCode::kMeshInvertedCell ? " (--allow-folds)" : "";
    throw Error(error.code(), options.mesh + ": " + error.what() + remedy, error.field(), error.ids());
  }
}

bool names_mesh_id(const MeshOptions& options) {
  if (!client::is_mesh_id(options.mesh)) return false;
  if (!options.grades.empty() || options.sharp.any() || options.allow_folds) {
    throw UsageError("--grade, --sharp-... and --allow-folds change a mesh file; " + options.mesh +
                     " is on the server already");
  }
  return true;
}

client::UploadOutcome upload(Session& session, const LoadedMesh& mesh) {
  if (!session.quiet()) {
    for (const std::string& warning : mesh.warnings) print_note("note: " + warning);
  }
  client::Client& client = session.client();
  Progress progress("uploading", "bytes", mesh.bytes->bytes().size(), session.quiet());
  const auto report = [&](std::uint64_t sent, std::uint64_t total) {
    progress.update(sent);
    constexpr std::size_t kManyCells = 2000;
    if (sent == total && mesh.mesh.cell_count() >= kManyCells && !session.quiet()) {
      print_note("the server prepares " + show_count(mesh.mesh.cell_count()) + " cells");
    }
  };
  return client.ensure_uploaded(mesh.bytes, report, session.call());
}

std::string ensure_on_server(Session& session, const MeshOptions& options) {
  if (names_mesh_id(options)) return options.mesh;
  const LoadedMesh mesh = load_mesh(options);
  upload(session, mesh);
  return mesh.bytes->id();
}

}  // namespace ccslice::cli
