// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Values besides those of the meshes' channels, and what is cut out by them: options of what slices, plans and draws.

#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "client/cli/options/volumes.h"

namespace ccslice::cli {

struct FieldOptions {
  std::vector<std::string> volumes;  // [world:]NAME=FILE[:OPTION...].
  std::vector<std::string> fields;   // [world:]NAME=FORMULA.
  std::string cut;                   // [world:]FORMULA; empty: nothing.
  /// Files that parse_fields() read, for all copies of the options.
  std::shared_ptr<LoadedVolumes> loaded = std::make_shared<LoadedVolumes>();
};

void add_field_options(CLI::App& command, FieldOptions& options);
/// Adds the option of what is cut out.
void add_cut_option(CLI::App& command, FieldOptions& options);

/// Volumes, then formulas, then the cut. Reads the files of volumes. Throws UsageError, Error{4xx, kVolumeInvalid}.
google::protobuf::RepeatedPtrField<v1::Field> parse_fields(const FieldOptions& options);
/// Name of the field that cuts, or empty.
std::string cut_of(const FieldOptions& options);

}  // namespace ccslice::cli
