// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The commands of `ccslice tray`, and the functions that they share: parts of a job with their names, surfaces and
// placements.

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/commands/job_options.h"
#include "client/surface.h"
#include "core/base/types.h"

namespace ccslice::cli {

Command add_tray_export(CLI::App& tray, CommonOptions& common);
Command add_tray_import(CLI::App& tray, CommonOptions& common);
Command add_tray_pack(CLI::App& tray, CommonOptions& common);

/// Most placements of a job's parts together, and parts, as job.proto has them.
inline constexpr std::size_t kMostPlacements = 4096, kMostParts = 256;

/// Largest distance from an exported triangle to the limit surface, mm, unless an option says another.
inline constexpr double kTrayChordMm = 0.05;

/// Returns each part's name, or else its mesh's file without folder and ending. REQUIRES: no mesh's id has taken the
/// place of its file yet.
std::vector<std::string> names_of_parts(const JobOptions& options, const v1::SliceJob& job);

/// The placements of a part. Throws UsageError for matrices that aren't 12 finite numbers.
std::vector<Placement> placements_of(const v1::Part& part, const std::string& name);
v1::Placement to_message(const Placement& placement);

/// The part's boundary in the frame of its mesh: no triangle is farther than that from the surface in any placement.
client::Surface tray_surface(Session& session, const v1::Part& part, const std::vector<Placement>& placements,
                             double chord_tolerance_mm);

/// Writes the job with the meshes' names of mesh_names_for() where there are any. Says how to slice it if a mesh has to
/// be on the server then.
void write_tray_job(const Session& session, const std::string& path, v1::SliceJob job,
                    const std::vector<std::string>& mesh_names);

}  // namespace ccslice::cli
