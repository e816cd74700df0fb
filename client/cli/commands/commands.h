// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// The commands of `ccslice`. Each is declared and run by a file of its own, command_*.cpp.

#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <vector>

#include "client/cli/session/session.h"

namespace ccslice::cli {

/// A command once its options are declared: what CLI11 knows of it, and what it does. Each `add_` function below
/// declares one; its options live as long as `run`.
struct Command {
  CLI::App* app = nullptr;
  std::function<void(Session&)> run;
};

Command add_printers(CLI::App& parent, CommonOptions& common);
Command add_models(CLI::App& parent, CommonOptions& common);
Command add_info(CLI::App& parent, CommonOptions& common);
Command add_convert(CLI::App& parent, CommonOptions& common);
Command add_upload(CLI::App& parent, CommonOptions& common);
Command add_plan(CLI::App& parent, CommonOptions& common);
Command add_slice(CLI::App& parent, CommonOptions& common);
Command add_join(CLI::App& parent, CommonOptions& common);
Command add_probe(CLI::App& parent, CommonOptions& common);
Command add_picture(CLI::App& parent, CommonOptions& common);
Command add_view(CLI::App& parent, CommonOptions& common);
Command add_export(CLI::App& parent, CommonOptions& common);
Command add_package(CLI::App& parent, CommonOptions& common);
/// `tray` and the commands below it.
std::vector<Command> add_tray(CLI::App& parent, CommonOptions& common);

}  // namespace ccslice::cli
