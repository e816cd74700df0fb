// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/processors.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/local_preparation.h"
#include "client/cli/meshes/mesh_convert.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/meshes/numbering.h"
#include "client/cli/output/documents.h"
#include "core/base/echo.h"
#include "core/mesh/cell_counts.h"
#include "core/mesh/cell_kind.h"
#include "core/mesh/face_cone.h"
#include "core/mesh_import/channels.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"

namespace ccslice::cli {
namespace {

struct InfoOptions {
  MeshOptions mesh;
  bool meshes = false;
  bool full = false;
};

/// Facts about the limit of a file's mesh, for which the mesh is prepared as a server does.
struct LimitFacts {
  v1::MeshSummary summary;
  std::vector<CellRegionSummary> cell_regions;
  std::uint64_t preparation_bytes = 0;  // What a server reserves to prepare it.
};

/// What a file holds, without a server.
struct FileFacts {
  std::array<std::size_t, kCellKinds.size()> cells_by_kind{};
  Box3 box;
  double volume_mm3 = 0;  // Of the control mesh, between bilinear faces.
  std::vector<std::array<float, 2>> channel_ranges;
  std::vector<CellRegionSummary> cell_regions;  // Without volumes of the limit, unless that is known.
  std::optional<LimitFacts> limit;
};

constexpr const char* kLeftOut =
    "size and volume of the limit, which is what gets printed, where it folds or overlaps, and the memory that a "
    "server takes to prepare the mesh: --full prepares it here and says them";

LimitFacts limit_of(const ControlMesh& mesh, bool quiet) {
  LimitFacts facts;
  LocalPreparation preparing("", quiet);
  PrepareOptions options;
  options.threads = processors();
  options.progress = preparing.begin();
  options.reserve = [&](std::uint64_t bytes) {
    facts.preparation_bytes = bytes;
    preparing.tell_memory(bytes);
  };
  try {
    const SolidSummary summary = prepare_solid(mesh, options)->summary();
    facts.summary = to_proto(summary);
    facts.cell_regions = summary.cell_regions;
  } catch (const std::bad_alloc&) {
    print_note("a server takes at least " + show_bytes(facts.preparation_bytes) + " to prepare the mesh");
    throw;
  }
  return facts;
}

/// Adds up cells, which may be listed inside out: only those that are reported as inverted really are.
void measure_cells(const LoadedMesh& loaded, FileFacts& facts) {
  const ControlMesh& mesh = loaded.mesh;
  for (const std::string& name : mesh.cell_region_names) facts.cell_regions.push_back({name, 0, 0, 0});
  std::vector<bool> inverted(mesh.cell_count());
  for (const std::uint32_t cell : loaded.report.inverted_cells) inverted[cell] = true;
  std::size_t first = 0;
  for (std::size_t cell = 0; cell < mesh.cell_count(); ++cell) {
    const CellKind kind = mesh.cell_kinds[cell];
    const std::span corners =
        std::span(mesh.cell_vertices).subspan(first, static_cast<std::size_t>(corner_count(kind)));
    first += corners.size();
    const double signed_volume =
        cell_volume(kind, corners, [&](std::uint32_t vertex) -> const Vec3& { return mesh.positions[vertex]; });
    const double volume = inverted[cell] ? signed_volume : std::abs(signed_volume);
    facts.volume_mm3 += volume;
    if (facts.cell_regions.empty()) continue;
    CellRegionSummary& region = facts.cell_regions[mesh.cell_regions[cell]];
    ++region.control_cells;
    region.control_volume_mm3 += volume;
  }
}

FileFacts facts_of(const LoadedMesh& loaded, bool full, bool quiet) {
  const ControlMesh& mesh = loaded.mesh;
  FileFacts facts;
  for (const CellKind kind : mesh.cell_kinds) ++facts.cells_by_kind[static_cast<std::size_t>(kind)];
  for (const Vec3& position : mesh.positions) facts.box.extend(position);
  for (std::size_t c = 0; c < mesh.channel_count(); ++c) facts.channel_ranges.push_back(channel_range(mesh, c));
  measure_cells(loaded, facts);
  if (!full) return facts;
  facts.limit = limit_of(mesh, quiet);
  facts.cell_regions = facts.limit->cell_regions;
  return facts;
}

v1::FileRegion document_of_region(const CellRegionSummary& region, bool full) {
  v1::FileRegion document;
  document.set_name(region.name);
  document.set_control_cells(region.control_cells);
  if (full) document.set_volume_mm3(region.volume_mm3);
  document.set_control_volume_mm3(region.control_volume_mm3);
  return document;
}

void count_cells(const FileFacts& facts, v1::FileDocument& document) {
  const auto count = [&](CellKind kind) { return facts.cells_by_kind[static_cast<std::size_t>(kind)]; };
  document.set_hexahedra(count(CellKind::kHex));
  document.set_tetrahedra(count(CellKind::kTet));
  document.set_wedges(count(CellKind::kWedge));
}

v1::FileDocument document_of_file(const LoadedMesh& loaded, const FileFacts& facts) {
  v1::FileDocument document;
  if (facts.limit) {
    document = document_of_limit(facts.limit->summary, loaded.numbers);
    document.set_preparation_bytes(facts.limit->preparation_bytes);
  }
  document.set_full(facts.limit.has_value());
  document.set_mesh_id(loaded.bytes->id());
  document.set_size_bytes(loaded.bytes->bytes().size());
  document.set_vertices(loaded.mesh.vertex_count());
  count_cells(facts, document);
  document.set_parts(loaded.parts.count);
  document.set_parts_of_one_cell(loaded.parts.of_one_cell);
  document.set_sharp_edges(loaded.mesh.sharp_edges.size());
  document.set_inverted_cells(loaded.report.inverted_cells.size());
  *document.mutable_control_box() = to_proto(facts.box);
  document.set_control_volume_mm3(facts.limit ? facts.limit->summary.deviation().control_volume_mm3()
                                              : facts.volume_mm3);
  for (std::size_t i = 0; i < facts.channel_ranges.size(); ++i) {
    v1::Channel& channel = *document.add_channels();
    channel.set_name(loaded.mesh.channel_names[i]);
    channel.set_min_value(facts.channel_ranges[i][0]);
    channel.set_max_value(facts.channel_ranges[i][1]);
  }
  for (const CellRegionSummary& region : facts.cell_regions) {
    *document.add_cell_regions() = document_of_region(region, facts.limit.has_value());
  }
  *document.mutable_notes() = {loaded.warnings.begin(), loaded.warnings.end()};
  return document;
}

/// Names the mesh that the volume within straight edges belongs to.
std::string faceted_mesh(const ControlMesh& mesh) {
  if (mesh.as_meshed) return mesh.mid_nodes.empty() ? "as meshed " : "as meshed, within straight edges ";
  return mesh.interpolating ? "mesh of the fitted control points " : "control mesh ";
}

std::string describe_size(const FileFacts& facts, const LoadedMesh& loaded) {
  if (!facts.limit) {
    return "\n  mesh size  " + describe(to_proto(facts.box)) + "\n  volume     " + faceted_mesh(loaded.mesh) +
           show_number(facts.volume_mm3) + " mm^3";
  }
  const v1::MeshSummary& summary = facts.limit->summary;
  return "\n  size       " + describe(summary.bounding_box()) + describe(summary.deviation(), loaded.numbers) +
         describe_faults(summary, loaded.numbers) + "\n  memory     " + show_bytes(facts.limit->preparation_bytes) +
         " in all, of a server's preparation budget";
}

std::string describe_region(const CellRegionSummary& region, bool full) {
  if (full) return describe(to_proto(region));
  return "\n  region     " + echoed(region.name) + ": " + show_count(region.control_cells, "cell") + ", " +
         show_number(region.control_volume_mm3) + " mm^3 of the control mesh";
}

std::string file_as_text(const std::string& name, const LoadedMesh& loaded, const FileFacts& facts) {
  std::string text = name + ": a valid control mesh\n  id         " + loaded.bytes->id();
  text += "\n  cells      ";
  for (std::size_t kind = 0; kind < kCellKinds.size(); ++kind) {
    text += (kind ? ", " : "") + show_count(facts.cells_by_kind[kind], noun_of(kCellKinds[kind].kind));
  }
  text += "\n  vertices   " + show_count(loaded.mesh.vertex_count()) + ", " +
          show_count(loaded.mesh.sharp_edges.size(), "sharp edge");
  if (loaded.parts.count > 1) {
    text += "\n  parts      " + show_count(loaded.parts.count) + ", " + show_count(loaded.parts.of_one_cell) +
            " of them of one cell";
  }
  text += describe_size(facts, loaded);
  for (std::size_t i = 0; i < facts.channel_ranges.size(); ++i) {
    text += "\n  channel    " + echoed(loaded.mesh.channel_names[i]) + ": " + show_number(facts.channel_ranges[i][0]) +
            " to " + show_number(facts.channel_ranges[i][1]);
  }
  for (const CellRegionSummary& region : facts.cell_regions) text += describe_region(region, facts.limit.has_value());
  if (!loaded.report.inverted_cells.empty()) {
    text += "\n  inverted   " + show_count(loaded.report.inverted_cells.size(), "cell");
  }
  for (const std::string& warning : loaded.warnings) text += "\n  note       " + warning;
  if (!facts.limit) text += std::string("\n  left out   ") + kLeftOut;
  return text;
}

template <typename Message>
void print_message(const Session& session, const Message& message) {
  print_line(session.options().json ? json_of(document_of(message)) : describe(message));
}

void print_meshes(Session& session) {
  const std::vector<v1::MeshSummary> meshes = session.client().list_meshes(session.call());
  std::vector<v1::ServerMesh> documents;
  for (const v1::MeshSummary& mesh : meshes) {
    if (!session.options().json) print_line(describe(mesh));
    documents.push_back(document_of(mesh));
  }
  if (session.options().json) return print_line(json_list_of(documents));
  if (meshes.empty() && !session.quiet()) print_note("the server holds no meshes");
}

void run_info(Session& session, const InfoOptions& options) {
  if (options.full && (options.meshes || options.mesh.mesh.empty() || names_mesh_id(options.mesh))) {
    throw UsageError("--full is for a mesh file: meshes on a server are prepared, and said in full");
  }
  if (options.meshes) return print_meshes(session);
  if (options.mesh.mesh.empty()) return print_message(session, session.server_info());
  if (names_mesh_id(options.mesh)) {
    return print_message(session, session.client().mesh_summary(options.mesh.mesh, session.call()));
  }
  const LoadedMesh loaded = load_mesh(options.mesh, session.quiet());
  const FileFacts facts = facts_of(loaded, options.full, session.quiet());
  print_line(session.options().json ? json_of(document_of_file(loaded, facts))
                                    : file_as_text(options.mesh.mesh, loaded, facts));
}

}  // namespace

Command add_info(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<InfoOptions>();
  CLI::App* app = parent.add_subcommand("info", "Say what a server, an uploaded mesh or a mesh file is");
  add_mesh_options(*app, options->mesh, false);
  app->add_flag("--meshes", options->meshes, "List the meshes that the server holds");
  app->add_flag("--full", options->full,
                "Prepare the mesh of a file as a server does, which takes as long, and say the size and the volume of "
                "its limit, which is what gets printed, how far it is from the mesh, where it folds or overlaps "
                "itself, and the memory that this takes");
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice info                    the server\n"
      "  ccslice info part.vtk           a file, without a server\n"
      "  ccslice info part.vtk --full    with what gets printed of it\n"
      "  ccslice info sha256:4be3...     a mesh on the server\n  ccslice info --meshes --json");
  return {app, [options](Session& session) { run_info(session, *options); }};
}

}  // namespace ccslice::cli
