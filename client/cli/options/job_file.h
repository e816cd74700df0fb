// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// A job as a file: the contract's SliceJob in protobuf's JSON, with the contract's names of fields. In a file the id of
// a mesh may also be a path, relative to the file's folder, or left out where MESH is given.

#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "ccslice/v1/job.pb.h"

namespace ccslice::cli {

/// Reads one. Throws UsageError for what isn't a job, which names the file and the place, and Error for what can't be
/// read.
v1::SliceJob read_job_file(const std::string& path);

/// Whether a file looks like one: a JSON object whose first member is one of a SliceJob's. Reads its beginning only.
bool is_job_file(const std::string& path);

/// Writes one over what is there.
void replace_job_file(const std::string& path, const v1::SliceJob& job);

/// Writes one, or leaves it as it is if it holds just this. Throws Error{kFileUnwritable} for a file with anything else
/// in it.
void write_job_file(const std::string& path, const v1::SliceJob& job);

/// Returns what a job in `job_file` calls a mesh file: its path from the job's folder on, if there is one, or else the
/// whole path. The counterpart of mesh_path().
std::string mesh_name_beside(const std::string& job_file, const std::string& mesh);

/// Returns the path of a part's mesh, of a job in this file. REQUIRES: `mesh_id` is no id.
std::string mesh_path(const std::string& job_file, const std::string& mesh_id);

}  // namespace ccslice::cli
