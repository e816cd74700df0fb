// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The job of `plan` and `slice`: said by options or by a file, its meshes on the server, and its plan.

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "ccslice/v1/plan.pb.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/meshes/numbering.h"
#include "client/cli/options/fields.h"
#include "client/cli/options/job.h"
#include "client/cli/options/part_places.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"
#include "client/cli/output/layer_files.h"
#include "client/cli/session/session.h"

namespace ccslice::cli {

struct JobOptions {
  MeshOptions mesh;
  PartOptions parts;
  PlacementOptions placement;
  GridOptions grid;
  PlaneOptions planes;
  LayoutOptions layout;
  FieldOptions fields;
  PrintingOptions printing;
  std::optional<double> smallest_feature_mm = std::nullopt;
  std::string software;  // Empty, or "grabcad".
  std::string file;      // That says the job; empty: the options do.
  std::string written_file;
  std::vector<const CLI::Option*> said_in_files;  // Options that say what a file says.
};

/// Options of the parts, where they go, and --job. A file with a job may also stand where MESH does.
void add_part_job_options(CLI::App& app, JobOptions& options, CommonOptions& common);
/// Options of the parts, where they go, the grid, the fields and the printing, and --job.
void add_placed_job_options(CLI::App& app, JobOptions& options, CommonOptions& common);
/// Those, and what is to be known of the layers.
void add_job_options(CLI::App& app, JobOptions& options, CommonOptions& common);

/// Adds the options of planes, layout and software, which plans and slices share.
void add_layer_options(CLI::App& app, JobOptions& options);

/// The parts in their places and nothing else, unless a file says the job. Throws UsageError.
v1::SliceJob parts_of(const JobOptions& options);
/// Adds the fields that options name, and what they cut.
void add_fields(const JobOptions& options, v1::SliceJob& job);
/// The job. Where options say it, without the ids of meshes, which put_on_server() gives it. Throws UsageError.
v1::SliceJob job_of(JobOptions options, const ContourFiles& contours);

/// By part: what its file calls vertices and cells.
using PartNumbers = std::vector<std::optional<FileNumbers>>;

/// Puts the job's meshes and volumes on the server, and writes the job's file if one is wanted. How near a fit has to
/// come to its vertices follows from the voxels.
PartNumbers put_on_server(Session& session, const JobOptions& options, v1::SliceJob& job);

/// By part: what a job that is to be written to `job_file` calls its mesh, so that `ccslice slice` finds it there: a
/// path from the job's folder on, or nothing where only the id will do, as options change what is in the file.
std::vector<std::string> mesh_names_for(const JobOptions& options, const v1::SliceJob& job,
                                        const std::string& job_file);

v1::PlanSlicesResponse plan_of(Session& session, const JobOptions& options, const v1::SliceJob& job);

/// The same in the numbers of the parts' files.
v1::PlanSlicesResponse in_numbers_of_files(v1::PlanSlicesResponse plan, const PartNumbers& numbers);

}  // namespace ccslice::cli
