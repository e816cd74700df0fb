// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What `slice` says of what it did.

#pragma once

#include <cstdint>
#include <string>

#include "client/cli/output/job_journal.h"
#include "client/cli/session/session.h"
#include "client/client.h"

namespace ccslice::cli {

/// A job once it is planned: what is to be sliced of it.
struct PlannedJob {
  v1::PlanSlicesResponse plan;
  v1::SliceRangeRequest whole, request;  // They differ if only a share is asked for.
  JobKey key;

  std::uint32_t layers() const { return request.layer_count(); }
};

/// What was written.
struct SliceResult {
  client::SliceOutcome outcome;
  std::string contact_sheet;  // Its path, unless there is none.
  std::uint64_t written_bytes = 0;
  double seconds = 0;  // That the layers took.
};

/// Where the layers go, for people. `output`: a folder, or "-".
std::string place_of(const std::string& output);

/// Of a job that was sliced just now, and of one that an earlier run had completed.
void report_sliced(const Session& session, const std::string& output, const PlannedJob& job, const SliceResult& result);
void report_complete(const Session& session, const std::string& output, const PlannedJob& job);

/// Says which parts share voxels, if any.
void warn_of_covered(const v1::SliceJob& job, const client::SliceOutcome& outcome);

/// Says which materials a job of all layers doesn't print.
void warn_of_materials(const client::SliceOutcome& outcome);

}  // namespace ccslice::cli
