// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/console.h"
#include "client/cli/json.h"
#include "client/cli/local_preparation.h"
#include "client/cli/manifest.h"
#include "client/cli/mesh_convert.h"
#include "client/cli/mesh_source.h"
#include "client/cli/processors.h"
#include "client/cli/text_values.h"
#include "core/base/echo.h"
#include "core/limit/deviation.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/channels.h"

namespace ccslice::cli {
namespace {

struct InfoOptions {
  MeshOptions mesh;
  bool meshes = false;
};

/// What a file holds, without a server.
struct FileFacts {
  std::array<std::size_t, kCellKinds.size()> cells_by_kind{};
  Box3 box;
  std::vector<std::array<float, 2>> channel_ranges;
  LimitShape limit;
  std::uint64_t preparation_bytes = 0;  // What a server reserves to prepare it.
};

FileFacts facts_of(const ControlMesh& mesh, bool quiet) {
  FileFacts facts;
  for (const CellKind kind : mesh.cell_kinds) ++facts.cells_by_kind[static_cast<std::size_t>(kind)];
  for (const Vec3& position : mesh.positions) facts.box.extend(position);
  for (std::size_t c = 0; c < mesh.channel_count(); ++c) facts.channel_ranges.push_back(channel_range(mesh, c));
  LocalPreparation preparing("", quiet);
  PrepareOptions options;
  options.threads = processors();
  options.progress = preparing.begin();
  options.reserve = [&](std::uint64_t bytes) {
    facts.preparation_bytes = bytes;
    preparing.tell_memory(bytes);
  };
  try {
    facts.limit = measure_limit(mesh, options);
  } catch (const std::bad_alloc&) {
    print_note("a server takes at least " + show_bytes(facts.preparation_bytes) + " to prepare the mesh");
    throw;
  }
  return facts;
}

std::string file_as_json(const LoadedMesh& loaded, bool quiet) {
  const FileFacts facts = facts_of(loaded.mesh, quiet);
  JsonWriter json;
  json.begin_object().member("mesh_id", loaded.bytes->id()).member("size_bytes", loaded.bytes->bytes().size());
  json.member("vertices", loaded.mesh.vertex_count());
  for (std::size_t kind = 0; kind < kCellKinds.size(); ++kind) {
    json.member(kCellKinds[kind].plural, facts.cells_by_kind[kind]);
  }
  json.member("sharp_edges", loaded.mesh.sharp_edges.size())
      .member("inverted_cells", loaded.report.inverted_cells.size());
  json.key("control_box");
  add_json(to_proto(facts.box), json);
  json.key("bounding_box");
  add_json(to_proto(facts.limit.bounding_box), json);
  json.key("deviation");
  add_json(to_proto(facts.limit.deviation), json);
  json.member("preparation_bytes", facts.preparation_bytes);
  json.key("channels").begin_array();
  for (std::size_t i = 0; i < facts.channel_ranges.size(); ++i) {
    json.begin_object().member("name", loaded.mesh.channel_names[i]).member("min_value", facts.channel_ranges[i][0]);
    json.member("max_value", facts.channel_ranges[i][1]).end_object();
  }
  json.end_array().key("cell_regions").begin_array();
  for (const CellRegionSummary& region : facts.limit.cell_regions) add_json(to_proto(region), json);
  json.end_array();
  add_notes(loaded, json);
  return json.end_object().text();
}

std::string file_as_text(const std::string& name, const LoadedMesh& loaded, bool quiet) {
  const FileFacts facts = facts_of(loaded.mesh, quiet);
  std::string text = name + ": a valid control mesh\n  id         " + loaded.bytes->id();
  text += "\n  cells      ";
  for (std::size_t kind = 0; kind < kCellKinds.size(); ++kind) {
    text += (kind ? ", " : "") + show_count(facts.cells_by_kind[kind]) + " " + std::string(kCellKinds[kind].plural);
  }
  text += "\n  vertices   " + show_count(loaded.mesh.vertex_count()) + ", " +
          show_count(loaded.mesh.sharp_edges.size()) + " sharp edges";
  text += "\n  size       " + describe(to_proto(facts.limit.bounding_box)) + describe(to_proto(facts.limit.deviation));
  text += "\n  memory     " + show_bytes(facts.preparation_bytes) + " of a server's preparation budget";
  for (std::size_t i = 0; i < facts.channel_ranges.size(); ++i) {
    text += "\n  channel    " + echoed(loaded.mesh.channel_names[i]) + ": " + show_number(facts.channel_ranges[i][0]) +
            " to " + show_number(facts.channel_ranges[i][1]);
  }
  for (const CellRegionSummary& region : facts.limit.cell_regions) text += describe(to_proto(region));
  if (!loaded.report.inverted_cells.empty()) {
    text += "\n  inverted   " + show_count(loaded.report.inverted_cells.size()) + " cells";
  }
  for (const std::string& warning : loaded.warnings) text += "\n  note       " + warning;
  return text;
}

template <typename Message>
void print_message(const Session& session, const Message& message) {
  if (!session.options().json) return print_line(describe(message));
  JsonWriter json;
  add_json(message, json);
  print_line(json.text());
}

void print_meshes(Session& session) {
  const std::vector<v1::MeshSummary> meshes = session.client().list_meshes(session.call());
  JsonWriter json;
  json.begin_array();
  for (const v1::MeshSummary& mesh : meshes) {
    if (!session.options().json) print_line(describe(mesh));
    add_json(mesh, json);
  }
  if (session.options().json) return print_line(json.end_array().text());
  if (meshes.empty() && !session.quiet()) print_note("the server holds no meshes");
}

void run_info(Session& session, const InfoOptions& options) {
  if (options.meshes) return print_meshes(session);
  if (options.mesh.mesh.empty()) return print_message(session, session.server_info());
  if (names_mesh_id(options.mesh)) {
    return print_message(session, session.client().mesh_summary(options.mesh.mesh, session.call()));
  }
  const LoadedMesh loaded = load_mesh(options.mesh, session.quiet());
  print_line(session.options().json ? file_as_json(loaded, session.quiet())
                                    : file_as_text(options.mesh.mesh, loaded, session.quiet()));
}

}  // namespace

Command add_info(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* app = parent.add_subcommand("info", "Say what a server, an uploaded mesh or a mesh file is");
  add_mesh_options(*app, options->mesh, false);
  app->add_flag("--meshes", options->meshes, "List the meshes that the server holds");
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice info                    the server\n"
      "  ccslice info part.vtk           a file, without a server\n"
      "  ccslice info sha256:4be3...     a mesh on the server\n  ccslice info --meshes --json");
  return {app, [options](Session& session) { run_info(session, *options); }};
}

}  // namespace ccslice::cli
