// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Options that go before material maps, or keep materials away from the surface: --where, --shell and --keep-out.

#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "ccslice/v1/job.pb.h"

namespace ccslice::cli {

/// Each may begin with region:NAME=, and then is for that cell region only.
struct OverrideOptions {
  std::vector<std::string> where{};      // CHANNEL<VALUE=MATERIAL.
  std::vector<std::string> shells{};     // MM=MATERIAL, in order from the surface.
  std::vector<std::string> keep_outs{};  // MATERIAL=MM:INSTEAD.
};

/// REQUIRES: options outlive the command's parsing.
void add_override_options(CLI::App& command, OverrideOptions& options, CLI::Option& material);

struct RegionOverride {
  std::optional<std::string> region;  // Nothing: of all.
  v1::MapOverride added;
};

/// In the order in which a map asks them, those of one region first. Throws UsageError.
[[nodiscard]] std::vector<RegionOverride> parse_overrides(const OverrideOptions& options);
/// The field of the depth that they read, if they read one. Throws UsageError.
[[nodiscard]] std::optional<v1::Field> parse_depth_field(const OverrideOptions& options);

}  // namespace ccslice::cli
