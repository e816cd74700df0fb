// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The parts of a job and where they go: options of `plan` and `slice`.

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"

namespace ccslice::cli {

struct PartOptions {
  std::vector<std::string> more;    // Meshes of further parts.
  std::vector<std::string> places;  // "10,0,0", mm: one a part, or one a copy of the only one.
  bool snap = false;
  std::string overlaps = "priority";
};

/// How copies and overlaps are treated.
void add_overlap_options(CLI::App& command, PartOptions& options);

void add_part_options(CLI::App& command, PartOptions& options);

/// Completes a job of one part, made of `mesh`, whose placement holds for all parts: adds the others, without the ids
/// of their meshes, and the names of several, moves each to its place, and says the rest of the options. Throws
/// UsageError.
void place_parts(const std::string& mesh, const PartOptions& options, v1::SliceJob& job);

}  // namespace ccslice::cli
