// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/job_options.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>

#include "client/cli/base/console.h"
#include "client/cli/base/text_values.h"
#include "client/cli/options/job_file.h"
#include "client/cli/output/grabcad.h"
#include "client/job.h"
#include "client/mesh_bytes.h"
#include "core/base/count_text.h"
#include "core/base/echo.h"
#include "core/base/error.h"

namespace ccslice::cli {
namespace {

/// The job of a file, which says all of it.
v1::SliceJob job_of_file(const JobOptions& options) {
  for (const CLI::Option* option : options.said_in_files) {
    if (option->count() == 0 || option->get_name() == "--volume") continue;
    throw UsageError(option->get_name() + ": --job says the whole job; leave the option out, or change the file");
  }
  v1::SliceJob job = read_job_file(options.file);
  if (options.software == "grabcad") require_grabcad_job(job);
  for (v1::Part& part : *job.mutable_parts()) {
    if (part.placements().empty()) *part.add_placements() = parse_placement({});  // The contract's default.
  }
  const std::size_t meshes = options.mesh.mesh.empty() ? 0 : 1 + options.parts.more.size();
  if (meshes != 0 && meshes != static_cast<std::size_t>(job.parts_size())) {
    throw UsageError("--job: " + options.file + " has " +
                     count_text(static_cast<std::size_t>(job.parts_size()), "part") + ", and there are " +
                     count_text(meshes, "mesh") + "; give one for each, or none");
  }
  return job;
}

/// Returns the file of a part's mesh, which the command line or the job names, or the mesh's id.
std::string mesh_of_part(const JobOptions& options, const v1::SliceJob& job, int p) {
  const std::string& id = job.parts(p).mesh_id();
  if (!options.mesh.mesh.empty()) {
    return p == 0 ? options.mesh.mesh : options.parts.more[static_cast<std::size_t>(p) - 1];
  }
  if (id.empty()) {
    throw UsageError("--job: parts[" + std::to_string(p) + "] of " + options.file +
                     " has no mesh_id; give it an id or a path, or name the files as MESH");
  }
  return client::is_mesh_id(id) ? id : mesh_path(options.file, id);
}

/// Says so where the command line names another mesh than the job does.
void note_stand_in(const JobOptions& options, const v1::SliceJob& job, int p, const std::string& mesh) {
  const std::string& id = job.parts(p).mesh_id();
  if (options.mesh.mesh.empty() || id.empty() || client::is_mesh_id(id)) return;
  print_note("note: " + echoed(mesh) + " stands in for " + echoed(id) + ", which " + options.file + " names in parts[" +
             std::to_string(p) + "]");
}

/// Names a job's file that isn't there before anything is missed that it would say.
void require_job_file(const std::string& mesh) {
  std::error_code ignored;
  if (!mesh.ends_with(".json") || std::filesystem::exists(mesh, ignored)) return;
  throw Error(ErrorCode::kFileUnreadable, echoed(mesh) + ": there is no such file to read");
}

/// Takes a job's file that stands where the mesh does as --job would.
void take_job_for_mesh(JobOptions& options, CommonOptions& common) {
  if (!options.file.empty() || !is_job_file(options.mesh.mesh)) return;
  options.file = common.job_file = options.mesh.mesh;
  options.mesh.mesh.clear();
  if (options.parts.more.empty()) return;
  options.mesh.mesh = options.parts.more.front();
  options.parts.more.erase(options.parts.more.begin());
}

void add_job_file_option(CLI::App& app, JobOptions& options, CommonOptions& common) {
  const auto take_file = [&](const std::string& file) { options.file = common.job_file = file; };
  app.add_option_function<std::string>(
         "--job", take_file,
         "Take the whole job from this file, a SliceJob in JSON as --write-job writes it, in place of options. "
         "Its parts name their meshes by id, or by paths beside the file; MESH and MORE say where meshes are "
         "that the server may lack, one for each part, and --volume NAME=FILE where volumes are. A job's file in place "
         "of MESH is taken alike")
      ->group("Job");
  app.parse_complete_callback([&] { take_job_for_mesh(options, common); });
}

/// Notes the options that `add` adds.
template <typename Add>
void said_in_files(const CLI::App& app, JobOptions& options, const Add& add) {
  const std::vector<const CLI::Option*> known = app.get_options();
  add();
  for (const CLI::Option* option : app.get_options()) {
    if (std::ranges::find(known, option) == known.end()) options.said_in_files.push_back(option);
  }
}

}  // namespace

void add_part_job_options(CLI::App& app, JobOptions& options, CommonOptions& common) {
  add_mesh_options(app, options.mesh, false);
  add_part_options(app, options.parts);
  said_in_files(app, options, [&] { add_placement_options(app, options.placement); });
  options.said_in_files.push_back(app.get_option("--at"));
  add_job_file_option(app, options, common);
}

void add_placed_job_options(CLI::App& app, JobOptions& options, CommonOptions& common) {
  add_mesh_options(app, options.mesh, false);
  add_part_options(app, options.parts);
  said_in_files(app, options, [&] {
    add_grid_options(app, options.grid);
    add_placement_options(app, options.placement);
    add_field_options(app, options.fields);
    add_cut_option(app, options.fields);
    add_printing_options(app, options.printing);
  });
  options.said_in_files.push_back(app.get_option("--at"));
  add_job_file_option(app, options, common);
}

void add_layer_options(CLI::App& app, JobOptions& options) {
  said_in_files(app, options, [&] {
    add_overlap_options(app, options.parts);
    add_plane_options(app, options.planes);
    add_layout_options(app, options.layout);
    add_background_option(app, options.printing);
  });
  app.add_option("--format", options.software,
                 "Write what this software takes. grabcad: slice_0.png, slice_1.png, ... as GrabCAD Voxel Print takes "
                 "them, with up to 6 materials; give a --printer too")
      ->check(CLI::IsMember({"grabcad"}))
      ->group("Pictures");
}

void add_job_options(CLI::App& app, JobOptions& options, CommonOptions& common) {
  add_placed_job_options(app, options, common);
  add_layer_options(app, options);
  app.add_option("--write-job", options.written_file, "Write the job that the options say to this file, for --job")
      ->group("Job");
  app.add_option("--smallest-feature", options.smallest_feature_mm,
                 "Warn where the part is thinner than this, in mm; 0 for no such warning (default: two voxels across)")
      ->group("Grid");
}

v1::SliceJob parts_of(const JobOptions& options) {
  if (!options.file.empty()) return job_of_file(options);
  if (options.mesh.mesh.empty()) throw UsageError("say which parts: MESH, or a file with a job");
  v1::SliceJob job = client::job_of("", parse_placement(options.placement));
  place_parts(options.mesh.mesh, options.parts, job);
  return job;
}

void add_fields(const JobOptions& options, v1::SliceJob& job) {
  *job.mutable_fields() = parse_fields(options.fields);
  job.set_cut(cut_of(options.fields));
  if (const std::optional<v1::Field> depth = parse_depth_field(options.printing.overrides)) *job.add_fields() = *depth;
}

v1::SliceJob job_of(JobOptions options, const ContourFiles& contours) {
  if (!options.file.empty()) return job_of_file(options);
  if (options.mesh.mesh.empty()) throw UsageError("say what to slice: MESH, or a file with --job");
  require_job_file(options.mesh.mesh);
  if (options.software == "grabcad") fit_to_grabcad(options.layout, options.planes);
  v1::SliceJob job = parse_job(options.grid, options.placement, options.printing);
  add_fields(options, job);
  place_parts(options.mesh.mesh, options.parts, job);
  *job.mutable_layout() = parse_layout(options.layout);
  const v1::Printing* const printing = job.has_printing() ? &job.printing() : nullptr;
  if (options.software == "grabcad") require_grabcad_materials(printing);
  const bool with_contours = contours.format != ContourFormat::kNone;
  for (v1::PlaneSpec& plane : parse_planes(options.planes, with_contours, printing)) {
    *job.add_planes() = std::move(plane);
  }
  if (with_contours) job.mutable_contours()->set_by_cell_region(contours.by_region);
  v1::Tolerances& tolerances = *job.mutable_tolerances();
  if (options.planes.tolerance_mm) tolerances.set_contour_mm(*options.planes.tolerance_mm);
  if (options.planes.channel_tolerance) tolerances.set_channel(*options.planes.channel_tolerance);
  tolerances.set_prove_channels(options.planes.prove_channels);
  return job;
}

PartNumbers put_on_server(Session& session, const JobOptions& options, v1::SliceJob& job) {
  PartNumbers numbers;
  load_volumes_of_job(options.file, options.fields.volumes, job, *options.fields.loaded);
  for (int p = 0; p < job.parts_size(); ++p) {
    MeshOptions mesh = options.mesh;
    mesh.mesh = mesh_of_part(options, job, p);
    if (!session.quiet()) note_stand_in(options, job, p, mesh.mesh);
    if (const v1::VoxelPitch& pitch = job.grid().pitch(); job.grid().has_pitch()) {
      mesh.meaning.voxel_mm = std::min({pitch.x_mm(), pitch.y_mm(), pitch.z_mm()});
    }
    session.forget_file();
    const std::string id = ensure_on_server(session, mesh, options.placement);
    if (const std::string& said = job.parts(p).mesh_id(); client::is_mesh_id(said) && said != id) {
      throw UsageError("--job: parts[" + std::to_string(p) + "] of " + options.file + " is of the mesh " + said +
                       ", and " + echoed(mesh.mesh) + " is " + id +
                       "; give the file and the options that the job was written with");
    }
    job.mutable_parts(p)->set_mesh_id(id);
    numbers.push_back(session.file_numbers());
  }
  if (!job.parts().empty()) put_volumes_on_server(session, job.parts(0).mesh_id(), *options.fields.loaded);
  if (job.parts_size() > 1) session.forget_file();  // What the server says is of any of the parts.
  if (!options.written_file.empty()) write_job_file(options.written_file, job);
  return numbers;
}

std::vector<std::string> mesh_names_for(const JobOptions& options, const v1::SliceJob& job,
                                        const std::string& job_file) {
  std::vector<std::string> names;
  for (int p = 0; p < job.parts_size(); ++p) {
    const std::string mesh = mesh_of_part(options, job, p);
    const bool needs_id = client::is_mesh_id(mesh) || change_mesh(options.mesh);
    names.push_back(needs_id ? "" : mesh_name_beside(job_file, mesh));
  }
  return names;
}

v1::PlanSlicesResponse plan_of(Session& session, const JobOptions& options, const v1::SliceJob& job) {
  v1::PlanSlicesRequest request;
  *request.mutable_job() = job;
  if (options.smallest_feature_mm) request.set_smallest_feature_mm(*options.smallest_feature_mm);
  return session.client().plan(request, session.call());
}

v1::PlanSlicesResponse in_numbers_of_files(v1::PlanSlicesResponse plan, const PartNumbers& numbers) {
  if (numbers.size() == 1) return numbers.front() ? renumbered(plan, *numbers.front()) : plan;
  for (v1::PlanWarning& warning : *plan.mutable_warnings()) {
    if (!warning.has_part() || warning.part() >= numbers.size() || !numbers[warning.part()]) continue;
    v1::PlanSlicesResponse alone;
    *alone.add_warnings() = warning;
    warning = renumbered(alone, *numbers[warning.part()]).warnings(0);
  }
  return plan;
}

}  // namespace ccslice::cli
