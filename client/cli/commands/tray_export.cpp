// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdint>
#include <memory>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/tray.h"
#include "client/cli/tray/tray_writer.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

struct TrayExportOptions {
  JobOptions job;
  std::string output;
  double chord_tolerance_mm = kTrayChordMm;
  bool force = false;
};

std::vector<TrayObject> objects_of(Session& session, const TrayExportOptions& options, v1::SliceJob job) {
  const std::vector<std::string> names = names_of_parts(options.job, job);
  std::vector<TrayObject> objects;
  for (int p = 0; p < job.parts_size(); ++p) {
    const std::string& name = names[static_cast<std::size_t>(p)];
    objects.push_back({name, {}, placements_of(job.parts(p), name)});
  }
  put_on_server(session, options.job, job);
  for (int p = 0; p < job.parts_size(); ++p) {
    TrayObject& object = objects[static_cast<std::size_t>(p)];
    object.surface = tray_surface(session, job.parts(p), object.placements, options.chord_tolerance_mm);
  }
  return objects;
}

void report(const Session& session, const std::string& output, const std::vector<TrayObject>& objects,
            std::uint64_t bytes) {
  v1::TrayFile file;
  file.set_file(output);
  file.set_size_bytes(bytes);
  std::uint64_t placements = 0, triangles = 0;
  for (const TrayObject& object : objects) {
    placements += object.placements.size();
    triangles += object.surface.triangles.size();
    v1::TrayPart& part = *file.add_parts();
    part.set_name(object.name);
    part.set_placements(object.placements.size());
  }
  file.set_triangles(triangles);
  if (session.options().json) return print_line(json_of(file));
  print_line(output + ": " + show_count(objects.size(), "part") + " in " + show_count(placements, "place") + ", " +
             show_count(triangles, "triangle") + ", " + show_bytes(bytes));
}

void run_tray_export(Session& session, const TrayExportOptions& options) {
  if (!options.output.ends_with(".3mf")) {
    throw UsageError("--output must end with .3mf, not '" + echoed(options.output) + "'");
  }
  refuse_to_overwrite(options.output, options.force);
  const std::vector<TrayObject> objects = objects_of(session, options, parts_of(options.job));
  const std::uint64_t bytes = write_tray(objects, options.output);
  report(session, options.output, objects, bytes);
}

}  // namespace

Command add_tray_export(CLI::App& tray, CommonOptions& common) {
  auto options = std::make_shared<TrayExportOptions>();
  CLI::App* app =
      tray.add_subcommand("export", "Write the parts of a job as a 3MF file, to arrange them in another program");
  add_part_job_options(*app, options->job, common);
  app->add_option("-o,--output", options->output, "File to write, NAME.3mf")->required();
  app->add_option("--chord-tolerance", options->chord_tolerance_mm,
                  "Largest distance from a triangle to the limit surface in mm. Give `tray import` the same one")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_server_options(*app, common);
  app->footer(
      "Each mesh becomes an object of its part's name, and each placement a build item. Open the file in PrusaSlicer, "
      "OrcaSlicer or Bambu Studio, move, turn, mirror and copy the objects, and save the project: `ccslice tray "
      "import` "
      "finds them in it.\n"
      "Examples:\n  ccslice tray export tray.json -o tray.3mf\n"
      "  ccslice tray export ring.ccmesh lid.ccmesh -o tray.3mf");
  return {app, [options](Session& session) { run_tray_export(session, *options); }};
}

}  // namespace ccslice::cli
