// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Exit codes for scripts: they say whose fault it was.

#pragma once

namespace ccslice::cli {

/// What the command line exits with. Numbers never change their meaning; `ccslice --help` lists them.
enum ExitCode : int {
  kExitOk = 0,
  kExitBug = 1,          // A fault of the program itself.
  kExitUsage = 2,        // The command line is wrong.
  kExitInput = 3,        // An input file can't be read, or its mesh is at fault.
  kExitRefused = 4,      // The server refused the request.
  kExitUnreachable = 5,  // No server, a busy server, or not in time, after all retries.
  kExitInterrupted = 6,  // Ctrl-C, or SIGTERM.
  kExitOutput = 7,       // The output can't be written, or is there already.
  kExitMismatch = 8,     // The answer is damaged, or layers are of two engines or grids.
};

}  // namespace ccslice::cli
