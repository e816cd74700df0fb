// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/processors.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/ccmesh.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/meshes/numbering.h"
#include "client/cli/meshes/vtu_file.h"
#include "client/cli/output/documents.h"
#include "core/mesh/cell_regions.h"
#include "core/mesh/region_values.h"
#include "core/prepare/prepare_solid.h"
#include "core/subdivision/refined_mesh.h"

namespace ccslice::cli {
namespace {

void require_file(const MeshOptions& options, const char* command) {
  if (names_mesh_id(options)) throw UsageError(std::string(command) + " takes a file, not the id of an uploaded mesh");
}

void run_upload(Session& session, const MeshOptions& options) {
  require_file(options, "upload");
  const LoadedMesh mesh = load_mesh(options, session.quiet());
  const client::UploadOutcome outcome = upload(session, mesh);
  if (session.options().json) {
    v1::UploadedMesh document;
    document.set_was_cached(outcome.was_cached);
    *document.mutable_mesh() = document_of(outcome.mesh, &mesh.numbers);
    *document.mutable_notes() = {mesh.warnings.begin(), mesh.warnings.end()};
    return print_line(json_of(document));
  }
  if (outcome.was_cached && !session.quiet()) print_note("the server held this mesh already");
  print_line(describe(outcome.mesh, mesh.numbers));
  if (session.server_is_private() && !session.quiet()) {
    print_note("the server that was started for this command ends with it, and so does what it holds");
  }
}

struct ConvertOptions {
  MeshOptions mesh;
  std::string output;
  std::optional<int> limit, bezier;
  bool force = false;
};

enum class MeshFormat : std::uint8_t { kCcmesh, kJson, kVtu };

MeshFormat format_of(const ConvertOptions& options) {
  const std::filesystem::path extension = std::filesystem::path(options.output).extension();
  if (extension == ".vtu") return MeshFormat::kVtu;
  if (options.limit) throw UsageError("--limit goes with .vtu, not with '" + options.output + "'");
  if (options.bezier) throw UsageError("--bezier goes with .vtu, not with '" + options.output + "'");
  if (extension == ".json") return MeshFormat::kJson;
  if (extension == ".ccmesh") return MeshFormat::kCcmesh;
  throw UsageError("convert writes .ccmesh, .json or .vtu, not '" + options.output + "'; export writes .stl and .vtk");
}

/// The mesh with copies of the vertices on interfaces, which have channels of their own.
ControlMesh split_regions(ControlMesh mesh) {
  const ConnectedMesh checked = validate_and_connect(mesh, {}, {});
  ControlMesh split = split_cell_regions(mesh, checked.complex).mesh;
  split.mid_nodes = {};  // They go by the vertices of before.
  return split;
}

std::string show_mid_nodes(const MidNodes& nodes) {
  return show_count(nodes.positions.size()) + " nodes between corners";
}

/// The limit, by the limit points of cells that are refined so many times.
std::string limit_as_vtu(ControlMesh mesh, int times) {
  constexpr std::size_t kMostCells = 20'000'000;
  if (!mesh.mid_nodes.empty()) {
    throw UsageError("--limit takes cells with straight edges, and these have " + show_mid_nodes(mesh.mid_nodes) +
                     ": give --bezier instead, which writes curved cells");
  }
  if (has_several_regions(mesh)) mesh = split_regions(std::move(mesh));
  const std::size_t cells = refined_cell_count(mesh, times);
  if (cells > kMostCells) {
    throw UsageError("--limit " + std::to_string(times) + " gives " + show_count(cells) + " cells, more than " +
                     show_count(kMostCells) + ": refine less often");
  }
  return to_vtu(mesh_of_limit_points(refine_mesh(mesh, times)), control_cells_of(mesh, times));
}

std::string bezier_as_vtu(const ControlMesh& mesh, int levels, bool quiet) {
  PrepareOptions options;
  options.threads = processors();
  const BezierCells cells = bezier_cells(mesh, levels, options);
  const auto plain = std::ranges::count(cells.cell_orders, 1);
  if (plain > 0 && !quiet) {
    print_note(show_count(static_cast<std::uint64_t>(plain)) + " of " + show_count(cells.cell_orders.size()) +
               " cells lie at irregular edges and vertices and aren't exact: hexahedra between limit points");
  }
  return to_vtu(cells, mesh.channel_names, mesh.cell_region_names);
}

std::string content_of(const LoadedMesh& mesh, MeshFormat format, const ConvertOptions& options, bool quiet) {
  if (format == MeshFormat::kCcmesh) return mesh.bytes->bytes();
  if (format == MeshFormat::kJson) return to_json(to_proto(mesh.mesh));
  if (options.limit) return limit_as_vtu(mesh.mesh, *options.limit);
  if (options.bezier) return bezier_as_vtu(mesh.mesh, *options.bezier, quiet);
  return region_value_count(mesh.mesh) == 0 ? to_vtu(mesh.mesh) : to_vtu(split_regions(mesh.mesh));
}

/// What a .vtu of the mesh doesn't say, so that whoever reads it again gets another part.
void note_losses(const ControlMesh& mesh, const ConvertOptions& options, std::vector<std::string>& notes) {
  if (options.limit || options.bezier) return;  // To look at.
  std::string lost;
  const auto lose = [&](const std::string& what) { lost += (lost.empty() ? "" : ", ") + what; };
  if (!mesh.sharp_edges.empty()) lose(show_count(mesh.sharp_edges.size()) + " sharp edges");
  if (!mesh.sharp_vertices.empty()) lose(show_count(mesh.sharp_vertices.size()) + " sharp corners");
  if (mesh.interpolating) lose("that control points were fitted");
  if (mesh.as_meshed) lose("that the mesh is taken as meshed");
  if (!vtu_keeps_mid_nodes(mesh)) lose(show_mid_nodes(mesh.mid_nodes));
  if (lost.empty()) return;
  notes.push_back(".vtu files don't keep: " + lost + "; write a .ccmesh or a .json to slice the part as it is");
}

void run_convert(Session& session, const ConvertOptions& options) {
  require_file(options.mesh, "convert");
  const MeshFormat format = format_of(options);
  refuse_to_overwrite(options.output, options.force);
  LoadedMesh mesh = load_mesh(options.mesh, session.quiet());
  if (format == MeshFormat::kVtu) note_losses(mesh.mesh, options, mesh.warnings);
  print_notes(session, mesh);
  const std::string content = content_of(mesh, format, options, session.quiet());
  write_file(options.output, content);
  if (session.options().json) {
    v1::ConvertedMesh document;
    document.set_file(options.output);
    document.set_mesh_id(mesh.bytes->id());
    document.set_size_bytes(content.size());
    *document.mutable_notes() = {mesh.warnings.begin(), mesh.warnings.end()};
    return print_line(json_of(document));
  }
  print_line(options.output + ": " + show_bytes(content.size()) + ", " + mesh.bytes->id());
}

}  // namespace

Command add_upload(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<MeshOptions>();
  CLI::App* app = parent.add_subcommand("upload", "Upload a mesh and print its id and what the server knows about it");
  add_mesh_options(*app, *options, true, true);
  add_server_options(*app, common);
  app->footer(
      "The other commands upload files themselves; use this to look at a mesh first, or to prepare a server.\n"
      "Examples:\n  ccslice upload part.mesh\n  ccslice upload part.vtk --grade stiffness=z:0..1 --grade dye=radial:z");
  return {app, [options](Session& session) { run_upload(session, *options); }};
}

Command add_convert(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ConvertOptions>();
  CLI::App* app = parent.add_subcommand(
      "convert", "Read, check, sharpen, fit, size and grade a mesh file; write it as .ccmesh, .json or .vtu");
  add_mesh_options(*app, options->mesh, true, true);
  app->add_option("-o,--output", options->output,
                  "File to write: .ccmesh, or .json; or .vtu to look at, in ParaView for example")
      ->required();
  constexpr int kMostRefinements = 8;
  app->add_option("--limit", options->limit,
                  "Write the limit volume to the .vtu, not the control mesh: limit points of cells that are refined so "
                  "many times, each into as many as it has corners")
      ->check(CLI::Range(0, kMostRefinements));
  app->add_option("--bezier", options->bezier,
                  "Write the limit volume to the .vtu as Bezier cells of degree 3, exact where the limit is: cells at "
                  "irregular edges and vertices are cut into eight so many times, and what is left there is plain "
                  "hexahedra")
      ->check(CLI::Range(0, kMostRefinements))
      ->excludes("--limit");
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_output_options(*app, common);
  app->footer(
      "Examples:\n  ccslice convert part.vtk --grade stiffness=z -o graded.ccmesh\n"
      "  ccslice convert part.ovm --sharp-angle 40 --grade skin=distance:90..30:2 -o sharp.json\n"
      "  ccslice convert part.mesh --units in --size z=30 --center --on-bed -o sized.ccmesh\n"
      "  ccslice convert part.inp --sharp-angle 40 --fit=boundary -o fitted.ccmesh\n"
      "  ccslice convert graded.ccmesh --limit 2 -o limit.vtu\n"
      "  ccslice convert graded.ccmesh --bezier 2 -o bezier.vtu");
  return {app, [options](Session& session) { run_convert(session, *options); }};
}

}  // namespace ccslice::cli
