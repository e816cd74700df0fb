// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// fit_table: how far limits are from their meshes before and after control points are fitted (docs/benchmarks.md).
// Whether vertices are met is read off the limit surface, not off the masks that the fit solves for.

#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "client/cli/base/json.h"
#include "core/base/error.h"
#include "core/base/read_file.h"
#include "core/limit/solid_data.h"
#include "core/mesh_authoring/sharpen.h"
#include "core/mesh_files/read_mesh.h"
#include "core/mesh_import/mesh_file.h"
#include "core/prepare/deviation.h"
#include "core/prepare/prepare_solid.h"
#include "core/vertex_fit/vertex_fit.h"
#include "tests/bench/bars.h"
#include "tests/bench/clocks.h"
#include "tests/oracle/real_meshes.h"
#include "tests/support/tiny_meshes.h"

namespace ccslice::bench {
namespace {

constexpr double kSharpAngleDeg = 40;

struct Options {
  std::vector<std::string> files;
  std::string json;
};

/// The limit of a fitted mesh beside the mesh that it was fitted to.
struct Fitted {
  std::string refusal;        // Of kAll: why not.
  std::size_t missed = 0;     // Boundary vertices farther than 1e-6 of the box from the limit surface's point ...
  double farthest = 0;        // ... as a share of the box's diagonal.
  double volume_percent = 0;  // Of the limit, more than of the mesh.
  double swelling_edges = 0;
  std::size_t new_folds = 0;  // Control cells that fold, and didn't.
  double seconds = 0;
};

struct Row {
  std::string mesh;
  std::size_t vertices = 0, boundary_vertices = 0;
  double volume_percent = 0, farthest = 0;  // Before.
  Fitted all, boundary;
};

double percent_more(double value, double than) { return 100 * (value / than - 1); }

Fitted measure(const ControlMesh& mesh, const LimitSolid& before, FittedVertices vertices) {
  Fitted result;
  Stopwatch watch;
  ControlMesh fitted;
  FitReport report;
  try {
    fitted = VertexFit(mesh).fit_positions(vertices, report);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::kMeshNotInterpolable) throw;
    result.refusal = error.what();
    return result;
  }
  result.seconds = watch.seconds();
  result.swelling_edges = report.swelling.edges;
  const auto solid = prepare_solid(fitted);
  const LimitSolid::Data& data = solid->data();
  const double diagonal = before.summary().deviation.control_box.diagonal().norm();
  const VertexLimits& boundary = data.boundary_vertices;
  for (std::size_t i = 0; i < boundary.ids.size(); ++i) {
    const double distance = (boundary.limits[i] - mesh.positions[boundary.ids[i]]).norm() / diagonal;
    result.missed += distance > 1e-6;
    result.farthest = std::max(result.farthest, distance);
  }
  result.volume_percent =
      percent_more(solid->summary().deviation.limit_volume_mm3, before.summary().deviation.control_volume_mm3);
  const auto folds = folding_control_cells(*solid), known = folding_control_cells(before);
  result.new_folds = static_cast<std::size_t>(
      std::ranges::count_if(folds, [&](auto c) { return !std::ranges::binary_search(known, c); }));
  return result;
}

Row measure(const std::string& name, const ControlMesh& mesh) {
  const auto before = prepare_solid(mesh);
  const Deviation& deviation = before->summary().deviation;
  Row row{name,
          mesh.vertex_count(),
          before->data().boundary_vertices.ids.size(),
          percent_more(deviation.limit_volume_mm3, deviation.control_volume_mm3),
          deviation.farthest.distance_mm() / deviation.control_box.diagonal().norm(),
          measure(mesh, *before, FittedVertices::kAll),
          measure(mesh, *before, FittedVertices::kBoundary)};
  return row;
}

std::string cell(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

void print(const Row& row) {
  const auto columns = [](const Fitted& fit) {
    if (!fit.refusal.empty()) return std::string("refused") + std::string(28, ' ');
    return cell("%7.0f", static_cast<double>(fit.missed)) + cell("%10.1e", fit.farthest) +
           cell("%+9.2f", fit.volume_percent) + cell("%8.3f ", fit.swelling_edges);
  };
  std::printf("%-32s %7zu %7zu |%+8.2f %9.1e |%s|%s %8.2f s\n", row.mesh.c_str(), row.vertices, row.boundary_vertices,
              row.volume_percent, row.farthest, columns(row.all).c_str(), columns(row.boundary).c_str(),
              row.boundary.seconds);
  std::fflush(stdout);
}

void add_json(const Fitted& fit, cli::JsonWriter& json) {
  json.begin_object().member("refusal", fit.refusal).member("missed_vertices", fit.missed);
  json.member("farthest_of_diagonal", fit.farthest).member("volume_percent", fit.volume_percent);
  json.member("swelling_edges", fit.swelling_edges).member("new_folding_cells", fit.new_folds);
  json.member("seconds", fit.seconds).end_object();
}

void write_json(const std::string& path, const std::vector<Row>& rows) {
  cli::JsonWriter json;
  json.begin_array();
  for (const Row& row : rows) {
    json.begin_object().member("mesh", row.mesh).member("vertices", row.vertices);
    json.member("boundary_vertices", row.boundary_vertices).member("volume_percent", row.volume_percent);
    json.member("farthest_of_diagonal", row.farthest).key("all");
    add_json(row.all, json);
    json.key("boundary");
    add_json(row.boundary, json);
    json.end_object();
  }
  json.end_array();
  std::ofstream file(path);
  file << json.text() << '\n';
  if (!file.flush()) throw std::runtime_error("cannot write " + path);
}

ControlMesh sharpened(ControlMesh mesh, bool reentrant) {
  validate(mesh);
  SharpEdges found = find_sharp_edges(mesh, kSharpAngleDeg);
  if (reentrant) found.convex.insert(found.convex.end(), found.reentrant.begin(), found.reentrant.end());
  add_sharp_features({std::move(found.convex), {}}, mesh);
  return mesh;
}

std::vector<std::pair<std::string, ControlMesh>> meshes(const Options& options) {
  std::vector<std::pair<std::string, ControlMesh>> found;
  const auto add = [&](const std::string& name, const std::optional<ControlMesh>& mesh) {
    if (mesh) found.emplace_back(name, *mesh);
  };
  const auto not_octant = [](int i, int j, int k) { return i != 1 || j != 1 || k != 1; };
  add("Fichera corner", oracle::box_mesh(2, 2, 2, 1, not_octant));
  for (const std::string& name : oracle::sample_names()) add(name, oracle::read_real_mesh_ungraded(name));
  for (const std::string& name : oracle::real_mesh_names()) add(name, oracle::read_real_mesh_ungraded(name));
  for (const std::string& path : options.files) {
    add(path.substr(path.rfind('/') + 1), read_mesh(read_file_bytes(path, std::uint64_t{1} << 32)).mesh);
  }
  return found;
}

/// A smooth cube of 103,823 vertices, before anything else takes memory.
void measure_large(BarTable& table) {
  const ControlMesh mesh = oracle::box_mesh(46, 46, 46, 1);
  Stopwatch watch;
  FitReport report;
  VertexFit(mesh).fit_positions(FittedVertices::kAll, report);
  table.add("103,823 vertices fitted and looked at for folds, one thread", watch.seconds(), "s", Bound::kAtMost, 10);
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  table.add("... peak memory of the process", static_cast<double>(usage.ru_maxrss) / 1024, "MiB", Bound::kAtMost, 1024);
}

int run(const Options& options) {
  BarTable large;
  measure_large(large);
  std::printf("\n%-32s %7s %7s |%8s %9s |%7s%10s%9s%8s |%7s%10s%9s%8s\n", "", "", "of the", "before: ", "", "all:", "",
              "", "swells", "bound.:", "", "", "swells");
  std::printf("%-32s %7s %7s |%8s %9s |%7s%10s%9s%8s |%7s%10s%9s%8s\n", "mesh", "vertices", "boundary", "volume%",
              "farthest", "missed", "farthest", "volume%", "edges", "missed", "farthest", "volume%", "edges");
  std::vector<Row> rows;
  for (const auto& [name, mesh] : meshes(options)) {
    rows.push_back(measure(name, mesh));
    print(rows.back());
    rows.push_back(measure(name + ", sharp", sharpened(mesh, false)));
    print(rows.back());
  }
  rows.push_back(measure("Fichera corner, all sharp", sharpened(meshes({}).front().second, true)));
  print(rows.back());
  std::printf("\n");
  double missed = 0, folds = 0;
  for (const Row& row : rows) {
    missed += static_cast<double>(row.all.missed);
    folds += static_cast<double>(row.all.new_folds + row.boundary.new_folds);
  }
  BarTable table;
  table.add("boundary vertices missed where all are fitted", missed, "vertices", Bound::kAtMost, 0);
  table.add("cells that fold and didn't", folds, "cells", Bound::kAtMost, 0);
  if (!options.json.empty()) write_json(options.json, rows);
  return large.missed() + table.missed() > 0 ? 1 : 0;
}

}  // namespace
}  // namespace ccslice::bench

int main(int argc, char** argv) {
  CLI::App app("How far limits are from their meshes, before and after control points are fitted");
  ccslice::bench::Options options;
  app.add_option("FILES", options.files, "More meshes, beside the samples and the real ones");
  app.add_option("--json", options.json, "Write the table to this file");
  CLI11_PARSE(app, argc, argv);
  try {
    return ccslice::bench::run(options);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "fit_table: %s\n", error.what());
    return 2;
  }
}
