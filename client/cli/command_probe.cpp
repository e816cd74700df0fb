// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>
#include <string>
#include <vector>

#include "client/cli/commands.h"
#include "client/cli/console.h"
#include "client/cli/json.h"
#include "client/cli/mesh_source.h"
#include "client/cli/placement.h"
#include "client/cli/text_values.h"
#include "core/base/echo.h"
#include "core/mesh/mesh_file.h"
#include "core/mesh/text_scanner.h"

namespace ccslice::cli {
namespace {

struct ProbeOptions {
  MeshOptions mesh;
  PlacementOptions placement;
  std::vector<std::string> at;
  std::string points_file;
};

constexpr std::uint64_t kMaxPointsFileBytes = 1ull << 30;

std::vector<double> points_of(const ProbeOptions& options) {
  std::vector<double> points;
  for (const std::string& text : options.at) {
    const std::vector<double> point = parse_numbers("--at", text, 3, 3);
    points.insert(points.end(), point.begin(), point.end());
  }
  if (!options.points_file.empty()) {
    std::string text = read_file_bytes(options.points_file, kMaxPointsFileBytes);
    for (char& c : text) c = c == ',' ? ' ' : c;
    TextScanner scanner(text);
    while (!scanner.at_end()) points.push_back(scanner.real("a coordinate"));
    if (points.size() % 3 != 0) throw UsageError(options.points_file + " must hold three coordinates a point");
  }
  if (points.empty())
    throw UsageError("name points: --at X,Y,Z, or --points FILE with x, y, z of a point on each line");
  return points;
}

const char* name_of(v1::PointLocation location) {
  switch (location) {
    case v1::POINT_LOCATION_INSIDE: return "inside";
    case v1::POINT_LOCATION_NEAR: return "near";
    default: return "outside";
  }
}

/// One answer, wherever in its batch.
struct PointAnswer {
  const v1::ProbePointsResponse& batch;
  int index;
  int channels;

  bool outside() const { return batch.locations(index) == v1::POINT_LOCATION_OUTSIDE; }
  double uvw(int i) const { return batch.uvw(3 * index + i); }
  double material(int channel) const { return batch.materials(index * channels + channel); }
};

void add_json(const double* point, const PointAnswer& answer, const v1::MeshSummary& mesh, JsonWriter& json) {
  json.begin_object().key("point_mm").begin_array().value(point[0]).value(point[1]).value(point[2]).end_array();
  json.member("location", name_of(answer.batch.locations(answer.index)));
  if (!answer.outside()) {
    json.member("limit_cell", answer.batch.limit_cells(answer.index));
    json.member("control_cell", answer.batch.control_cells(answer.index)).key("uvw").begin_array();
    for (int i = 0; i < 3; ++i) json.value(answer.uvw(i));
    json.end_array().member("residual_mm", answer.batch.residuals_mm(answer.index)).key("materials").begin_object();
    for (int i = 0; i < mesh.channels_size(); ++i) json.member(mesh.channels(i).name(), answer.material(i));
    json.end_object();
  }
  json.end_object();
}

std::string as_text(const double* point, const PointAnswer& answer, const v1::MeshSummary& mesh) {
  std::string text = "(" + show_number(point[0]) + ", " + show_number(point[1]) + ", " + show_number(point[2]) + ") " +
                     name_of(answer.batch.locations(answer.index));
  if (answer.outside()) return text;
  text += ", cell " + std::to_string(answer.batch.control_cells(answer.index)) + " (" + show_number(answer.uvw(0)) +
          ", " + show_number(answer.uvw(1)) + ", " + show_number(answer.uvw(2)) + ")";
  for (int i = 0; i < mesh.channels_size(); ++i) {
    text += ", " + echoed(mesh.channels(i).name()) + " " + show_number(answer.material(i));
  }
  return text;
}

void run_probe(Session& session, const ProbeOptions& options) {
  const std::vector<double> points = points_of(options);
  const v1::Placement placement = parse_placement(options.placement);
  const std::string id = ensure_on_server(session, options.mesh);
  const v1::MeshSummary mesh = session.client().mesh_summary(id, session.call());
  JsonWriter json;
  json.begin_array();
  std::size_t at = 0;
  for (const v1::ProbePointsResponse& batch : session.client().probe(id, placement, points, session.call())) {
    for (int i = 0; i < batch.locations_size(); ++i, at += 3) {
      const PointAnswer answer{batch, i, mesh.channels_size()};
      if (session.options().json) {
        add_json(&points[at], answer, mesh, json);
      } else {
        print_line(as_text(&points[at], answer, mesh));
      }
    }
  }
  if (session.options().json) print_line(json.end_array().text());
}

}  // namespace

Command add_probe(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<ProbeOptions>();
  CLI::App* app = parent.add_subcommand("probe", "Say whether points are inside, in which cell, and of what material");
  add_mesh_options(*app, options->mesh);
  app->add_option("--at", options->at, "A point, X,Y,Z in mm; may be repeated")->allow_extra_args(false);
  app->add_option("--points", options->points_file, "A file of points, x y z or x,y,z on each line");
  add_placement_options(*app, options->placement);
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice probe ring.ccmesh --at 34,0,8 --at 0,0,0\n  ccslice probe part.vtk --grade "
      "stiffness=z --points points.csv --json");
  return {app, [options](Session& session) { run_probe(session, *options); }};
}

}  // namespace ccslice::cli
