// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Which options of `picture` fit which pictures. Help and errors both come from one table.

#pragma once

#include <CLI/CLI.hpp>

#include "client/cli/commands/picture_options.h"

namespace ccslice::cli {

/// Says in the help of each option which pictures it is for. REQUIRES: the command has all of its options.
void describe_fits(CLI::App& command);

/// Throws UsageError for an option that the command line has, and that the picture makes nothing of. `has_materials`:
/// the job or the options name some.
void check_fits(const CLI::App& command, const PictureOptions& options, bool has_materials);

}  // namespace ccslice::cli
