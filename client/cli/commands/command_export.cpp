// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>
#include <optional>
#include <string>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/placement.h"
#include "client/cli/output/surface_file.h"

namespace ccslice::cli {
namespace {

struct ExportOptions {
  MeshOptions mesh;
  PlacementOptions placement;
  std::optional<double> chord_tolerance_mm = std::nullopt;
  std::string output;
  bool force = false;
};

using Writer = std::string (*)(const client::Surface&);

Writer writer_of(const std::string& output) {
  if (output.ends_with(".stl")) return to_stl;
  if (output.ends_with(".vtk")) return to_vtk;
  throw UsageError("--output must end with .stl or .vtk, not '" + output + "'");
}

void report(const Session& session, const std::string& output, const client::Surface& surface, std::size_t bytes) {
  if (session.options().json) {
    v1::BoundaryFile file;
    file.set_file(output);
    file.set_mesh_id(surface.header.mesh_id());
    file.set_triangles(surface.triangles.size());
    file.set_vertices(surface.points_mm.size());
    file.set_volume_mm3(volume_mm3(surface));
    file.set_size_bytes(bytes);
    return print_line(json_of(file));
  }
  print_line(output + ": " + show_count(surface.triangles.size()) + " triangles, " +
             show_count(surface.points_mm.size()) + " vertices, " + show_number(volume_mm3(surface)) + " mm^3, " +
             show_bytes(bytes));
}

void run_export(Session& session, const ExportOptions& options) {
  const Writer write = writer_of(options.output);
  refuse_to_overwrite(options.output, options.force);
  v1::TessellateBoundaryRequest request;
  *request.mutable_placement() = parse_placement(options.placement);
  if (options.chord_tolerance_mm) request.set_chord_tolerance_mm(*options.chord_tolerance_mm);
  request.set_mesh_id(ensure_on_server(session, options.mesh, options.placement));
  const client::Surface surface = session.client().tessellate(request, session.call());
  const std::string file = write(surface);
  write_file(options.output, file);
  report(session, options.output, surface, file.size());
}

}  // namespace

Command add_export(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ExportOptions>();
  CLI::App* app = parent.add_subcommand("export", "Write the boundary as triangles: STL, or VTK with the channels");
  add_mesh_options(*app, options->mesh);
  app->add_option("-o,--output", options->output, "File to write: .stl (binary), or .vtk (legacy, binary)")->required();
  app->add_option("--chord-tolerance", options->chord_tolerance_mm,
                  "Largest distance from a triangle to the limit surface in mm (default 0.05)");
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_placement_options(*app, options->placement);
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice export ring.ccmesh -o ring.stl\n"
      "  ccslice export part.vtk --grade stiffness=z --chord-tolerance 0.01 --rotate x=90 -o surface.vtk");
  return {app, [options](Session& session) { run_export(session, *options); }};
}

}  // namespace ccslice::cli
