// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Manual pages and completions, made of what --help says.

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace ccslice::cli {

/// All commands of the program: those with commands below them come before these.
std::vector<const CLI::App*> all_commands(const CLI::App& app);
/// "ccslice-tray-pack": what the page of a command is called.
std::string page_name(const CLI::App& command);
/// A page of section 1 for man(1), of the program or of one of its commands.
std::string manual_page(const CLI::App& app);
/// Completes commands, options, their values and file names in bash.
std::string bash_completion(const CLI::App& app);
/// Completes the same in zsh, with what each option does.
std::string zsh_completion(const CLI::App& app);

}  // namespace ccslice::cli
