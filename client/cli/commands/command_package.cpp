// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <memory>
#include <optional>
#include <string>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/output/gcvf.h"
#include "client/cli/output/grabcad.h"
#include "client/cli/output/layer_stack.h"
#include "client/cli/output/three_mf.h"

namespace ccslice::cli {
namespace {

struct PackageOptions {
  std::string folder;
  std::string output;
  std::string mesh = {};  // A file, or the id of an uploaded mesh. Empty: the one that the server holds.
  std::optional<double> chord_tolerance_mm = std::nullopt;
  bool force = false;
};

/// The id, on the server, of the mesh that was sliced.
std::string sliced_mesh(Session& session, const LayerStack& stack, const PackageOptions& options) {
  if (options.mesh.empty()) return stack.part().mesh_id();
  MeshOptions mesh;
  mesh.mesh = options.mesh;
  const std::string id = ensure_on_server(session, mesh);
  if (id != stack.part().mesh_id() && !session.quiet()) {
    print_note("note: " + options.mesh + " isn't the mesh that was sliced; what matters here is that its boundary is");
  }
  return id;
}

client::Surface boundary_of(Session& session, const LayerStack& stack, const PackageOptions& options) {
  if (stack.has_several_parts()) {
    throw UsageError(
        "a .3mf file holds the boundary of one part, and these layers are of several parts or copies; slice each by "
        "itself, or write a .gcvf file");
  }
  v1::TessellateBoundaryRequest request;
  request.set_mesh_id(sliced_mesh(session, stack, options));
  if (!stack.part().placements().empty()) *request.mutable_placement() = stack.part().placements(0);
  if (options.chord_tolerance_mm) request.set_chord_tolerance_mm(*options.chord_tolerance_mm);
  try {
    return session.client().tessellate(request, session.call());
  } catch (const client::ClientError& error) {
    if (error.missing_mesh_id().empty()) throw;
    throw UsageError(
        "a .3mf file holds the part's boundary, which the server makes of the mesh; it doesn't hold it: "
        "name the file that was sliced with --mesh");
  }
}

std::uint64_t write_package(Session& session, const PackageOptions& options, const LayerStack& stack) {
  if (options.output.ends_with(".gcvf")) {
    const std::uint64_t bytes = write_gcvf(stack, options.output);
    if (session.quiet()) return bytes;
    print_note("note: .gcvf is experimental: its format isn't published, and no printer has read a file of ours yet");
    if (stack.layers() < kFewestGrabcadLayers) {
      print_note("warning: GrabCAD takes no fewer than " + std::to_string(kFewestGrabcadLayers) +
                 " layers, and there are " + std::to_string(stack.layers()));
    }
    return bytes;
  }
  require_three_mf_stack(stack);
  const bool leaves_empty = std::ranges::any_of(
      stack.materials(), [](const StackMaterial& material) { return material.leaves_empty && material.voxels > 0; });
  if (leaves_empty && !session.quiet()) {
    print_note("warning: a .3mf file holds the whole part: voxels that the layers leave empty aren't empty in it");
  }
  return write_three_mf(stack, boundary_of(session, stack, options), options.output);
}

void run_package(Session& session, const PackageOptions& options) {
  if (!options.output.ends_with(".gcvf") && !options.output.ends_with(".3mf")) {
    throw UsageError("--output must end with .gcvf or .3mf, not '" + options.output + "'");
  }
  refuse_to_overwrite(options.output, options.force);
  const LayerStack stack(options.folder);
  const std::uint64_t bytes = write_package(session, options, stack);
  if (session.options().json) {
    v1::PackageFile file;
    file.set_file(options.output);
    file.set_layers(stack.layers());
    file.set_size_bytes(bytes);
    return print_line(json_of(file));
  }
  print_line(options.output + ": " + show_count(stack.layers(), "layer") + ", " + show_bytes(bytes));
}

}  // namespace

Command add_package(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<PackageOptions>();
  CLI::App* app = parent.add_subcommand("package", "Pack a folder of layers into one file: .gcvf or volumetric .3mf");
  app->add_option("FOLDER", options->folder, "Folder that `slice` wrote")->required();
  app->add_option(
         "-o,--output", options->output,
         "File to write: .gcvf (experimental; RGBA pictures of at most 6 materials), or .3mf (the boundary, and "
         "8-bit PNG pictures of channels as mixing ratios; asks the server for the boundary)")
      ->required();
  app->add_option("--mesh", options->mesh,
                  "For a .3mf: the mesh file that was sliced, if the server doesn't hold it any more");
  app->add_option("--chord-tolerance", options->chord_tolerance_mm,
                  "Largest distance from a triangle of a .3mf's boundary to the limit surface in mm (default 0.05)");
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice slice ring.ccmesh --pitch 0.2 --channel hardness -o ring\n"
      "  ccslice package ring --mesh ring.ccmesh -o ring.3mf");
  return {app, [options](Session& session) { run_package(session, *options); }};
}

}  // namespace ccslice::cli
