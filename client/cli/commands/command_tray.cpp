// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/tray.h"
#include "client/cli/options/job_file.h"
#include "client/mesh_bytes.h"
#include "core/base/echo.h"

namespace ccslice::cli {

std::vector<Command> add_tray(CLI::App& parent, CommonOptions& common) {
  CLI::App* app = parent.add_subcommand(
      "tray", "Arrange parts on a printer's tray: by itself, or in PrusaSlicer, OrcaSlicer or Bambu Studio");
  app->require_subcommand(1);
  app->footer(
      "Examples:\n  ccslice tray pack ring.ccmesh lid.ccmesh --copies 4 --printer j750-hm -o tray.json\n"
      "  ccslice slice tray.json -o layers\n"
      "  ccslice tray export tray.json -o tray.3mf\n"
      "  ccslice tray import plate.3mf --job tray.json -o plate.json\n"
      "`ccslice help tray COMMAND` explains a command.");
  return {add_tray_pack(*app, common), add_tray_export(*app, common), add_tray_import(*app, common)};
}

std::vector<std::string> names_of_parts(const JobOptions& options, const v1::SliceJob& job) {
  std::vector<std::string> names;
  for (int p = 0; p < job.parts_size(); ++p) {
    std::string name = job.parts(p).name();
    std::string mesh = job.parts(p).mesh_id();
    if (!options.mesh.mesh.empty()) {
      mesh = p == 0 ? options.mesh.mesh : options.parts.more[static_cast<std::size_t>(p) - 1];
    }
    if (name.empty() && !client::is_mesh_id(mesh)) name = echoed(std::filesystem::path(mesh).stem().string());
    names.push_back(name.empty() ? "part" : name);
  }
  return names;
}

std::vector<Placement> placements_of(const v1::Part& part, const std::string& name) {
  constexpr int kEntries = 12;
  std::vector<Placement> placements;
  for (const v1::Placement& message : part.placements()) {
    const auto& matrix = message.matrix();
    const bool finite = std::ranges::all_of(matrix, [](double entry) { return std::isfinite(entry); });
    if (!finite || (!matrix.empty() && matrix.size() != kEntries)) {
      throw UsageError("--job: placements[" + std::to_string(placements.size()) + "] of the part '" + echoed(name) +
                       "' has no matrix of 12 finite numbers; give them row by row, or leave the matrix out");
    }
    Placement& placement = placements.emplace_back(Placement::Identity());
    for (int i = 0; i < matrix.size(); ++i) placement.matrix()(i / 4, i % 4) = matrix[i];
  }
  if (placements.empty()) placements.push_back(Placement::Identity());
  return placements;
}

v1::Placement to_message(const Placement& placement) {
  v1::Placement message;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 4; ++column) message.add_matrix(placement.matrix()(row, column));
  }
  return message;
}

client::Surface tray_surface(Session& session, const v1::Part& part, const std::vector<Placement>& placements,
                             double chord_tolerance_mm) {
  double largest_scale = 0;
  for (const Placement& placement : placements) {
    largest_scale = std::max(largest_scale, Eigen::JacobiSVD<Mat3>(placement.linear()).singularValues()[0]);
  }
  v1::TessellateBoundaryRequest request;
  request.set_mesh_id(part.mesh_id());
  // Turns have a scale of 1 but for rounding, and two commands should ask for the same triangles.
  constexpr double kRounding = 1e-6;
  const bool is_scaled = std::abs(largest_scale - 1) > kRounding && largest_scale > 0;
  request.set_chord_tolerance_mm(is_scaled ? chord_tolerance_mm / largest_scale : chord_tolerance_mm);
  return session.client().tessellate(request, session.call());
}

void write_tray_job(const Session& session, const std::string& path, v1::SliceJob job,
                    const std::vector<std::string>& mesh_names) {
  bool needs_meshes = false;
  for (int p = 0; p < job.parts_size(); ++p) {
    const std::string& name = mesh_names[static_cast<std::size_t>(p)];
    needs_meshes = needs_meshes || name.empty();
    if (!name.empty()) job.mutable_parts(p)->set_mesh_id(name);
  }
  replace_job_file(path, job);
  if (!needs_meshes || session.quiet()) return;
  print_note("note: " + path +
             " names meshes by their ids, since options change what is in their files, or ids were given: give ccslice "
             "slice the same files and options of the mesh behind it, unless the server holds the meshes by then");
}

}  // namespace ccslice::cli
