// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccslice, the command line: reads the arguments, runs one command, and says by its exit code how it went.

#include <google/protobuf/stubs/logging.h>
#include <grpc/support/log.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <string>
#include <string_view>
#include <vector>

#include "client/cancellation.h"
#include "client/cli/base/console.h"
#include "client/cli/base/exit_codes.h"
#include "client/cli/base/failure.h"
#include "client/cli/base/interrupt.h"
#include "client/cli/commands/help.h"
#include "client/cli/commands/program.h"
#include "client/cli/meshes/numbering.h"
#include "core/base/variables.h"

namespace ccslice::cli {
namespace {

/// The arguments, where `help COMMAND` stands for `COMMAND --help`. In the order that CLI::App::parse takes: backwards.
std::vector<std::string> arguments_of(const CLI::App& app, int argc, char** argv) {
  std::vector<std::string> arguments(argv + 1, argv + argc);
  if (!arguments.empty() && arguments.front() == "help") {
    arguments.erase(arguments.begin());
    // An unknown command is left for the parser to refuse.
    const auto is_meant = [&](const CLI::App* command) { return command->get_name() == arguments.front(); };
    const bool known = arguments.empty() || !app.get_subcommands(is_meant).empty();
    if (known) arguments.push_back("--help");
  }
  std::reverse(arguments.begin(), arguments.end());
  return arguments;
}

/// The server's findings on the mesh are told in the numbers of its file.
void run(const Command& command, Session& session) {
  try {
    command.run(session);
  } catch (const client::ClientError& error) {
    if (!session.file_numbers()) throw;
    throw renumbered(error, *session.file_numbers());
  }
}

int run(const Program& program) {
  const CommonOptions& options = program.options;
  client::Cancellation cancellation;
  const InterruptGuard guard(cancellation);
  try {
    Session session(options, cancellation);
    for (const Command& command : program.commands) {
      if (command.app->parsed() > 0) run(command, session);
    }
    return kExitOk;
  } catch (const std::exception& exception) {
    const Failure failure = failure_of(exception, options.job_file);
    print_failure(failure, options.json);
    return failure.exit_code;
  }
}

/// What was printed has arrived, unless the output is a full disk or the like.
int flushed(int exit_code) {
  const bool lost = std::fflush(stdout) != 0 || std::ferror(stdout) != 0;
  if (!lost || exit_code != kExitOk) return exit_code;
  print_note("ccslice: standard output can't be written");
  return kExitOutput;
}

/// Looked for by hand where the arguments couldn't be parsed.
bool wants_json(int argc, char** argv) {
  return std::any_of(argv, argv + argc, [](const char* argument) { return std::string_view(argument) == "--json"; });
}

}  // namespace
}  // namespace ccslice::cli

int main(int argc, char** argv) {
  using namespace ccslice::cli;
  google::protobuf::SetLogHandler(nullptr);  // What it has to say about hostile files, our errors say.
  // Likewise about connections that fail, five times a second. Who wants to know more sets the variable.
  if (std::getenv("GRPC_VERBOSITY") == nullptr) gpr_set_log_function([](gpr_log_func_args*) {});
  Program program;
  CLI::App& app = program.app;
  if (argc == 1) {
    print_note(app.help());
    return kExitUsage;
  }
  try {
    app.parse(arguments_of(app, argc, argv));
  } catch (const CLI::Success& success) {
    return flushed(app.exit(success));
  } catch (const CLI::ParseError& error) {
    print_failure({kExitUsage, "USAGE", describe_parse_error(app, error)}, wants_json(argc, argv));
    return kExitUsage;
  }
  if (const std::string fault = ccslice::describe_unknown_variable(environ); !fault.empty()) {
    print_failure({kExitUsage, "USAGE", fault}, wants_json(argc, argv));
    return kExitUsage;
  }
  return flushed(run(program));
}
