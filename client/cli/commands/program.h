// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// All commands of ccslice, declared: what the program parses, and what its manual and completions are made of.

#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "client/cli/commands/commands.h"
#include "client/cli/session/session.h"

namespace ccslice::cli {

struct Program {
  Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  CLI::App app;
  CommonOptions options;  // Where parsing puts what all commands share.
  std::vector<Command> commands;
};

}  // namespace ccslice::cli
