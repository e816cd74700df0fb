// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Manual pages and completions, made of what --help says.

#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace ccslice::cli {

/// A page of section 1 for man(1), of the program or of one of its commands.
std::string manual_page(const CLI::App& app);
/// Completes commands, options, their values and file names in bash.
std::string bash_completion(const CLI::App& app);
/// Completes the same in zsh, with what each option does.
std::string zsh_completion(const CLI::App& app);

}  // namespace ccslice::cli
