// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// How a command fails: every exception becomes an exit code, a reason and a message.

#pragma once

#include <exception>
#include <string>

#include "client/cli/base/exit_codes.h"

namespace ccslice::cli {

/// What went wrong, for the user and for scripts.
struct Failure {
  ExitCode exit_code = kExitBug;
  std::string reason;  // As in ErrorInfo.reason; "USAGE" for command lines.
  std::string message;
};

/// Turns any exception of a command into a failure.
/// `job_file`: that says the job whose fields servers speak of, in place of options; or empty.
Failure failure_of(const std::exception& exception, const std::string& job_file = {});

/// Prints {"error":{...}} on standard output.
void print_error_document(const Failure& failure);

/// Prints the failure on standard error, and with `json` the document too.
void print_failure(const Failure& failure, bool json);

}  // namespace ccslice::cli
