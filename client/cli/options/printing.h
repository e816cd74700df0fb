// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// What is printed with: the options of `plan` and `slice` for materials, their mixing and halftoning.

#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"
#include "client/cli/options/map_overrides.h"

namespace ccslice::cli {

struct PrintingOptions {
  std::vector<std::string> materials;  // NAME=#RRGGBB[AA]; "void" is nothing.
  std::vector<std::string> maps;       // [region:NAME=]blend:..., calibration:..., direct:..., colour:..., material:...
  OverrideOptions overrides{};
  std::string halftone = "blue-noise";
  std::uint64_t seed = 0;
  bool strict = false;
  std::string background;                // #RRGGBB[AA].
  std::vector<std::string> densities{};  // NAME=G, or G for all.
};

void add_printing_options(CLI::App& command, PrintingOptions& options);
/// The colour of voxels outside, which pictures of layers hold and drawings don't show.
void add_background_option(CLI::App& command, PrintingOptions& options);

/// Nothing if no material is named. Throws UsageError.
[[nodiscard]] std::optional<v1::Printing> parse_printing(const PrintingOptions& options);

}  // namespace ccslice::cli
