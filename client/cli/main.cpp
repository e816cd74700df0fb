// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// ccslice, the command line: reads the arguments, runs one command, and says by its exit code how it went.

#include <google/protobuf/stubs/logging.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <exception>
#include <string_view>
#include <vector>

#include "client/cancellation.h"
#include "client/cli/commands.h"
#include "client/cli/console.h"
#include "client/cli/exit_codes.h"
#include "client/cli/failure.h"
#include "client/cli/interrupt.h"
#include "client/cli/session.h"

namespace ccslice::cli {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 done, 2 wrong command line, 3 an input file is at fault, 4 the server refused,\n"
    "5 no server or not in time, 6 interrupted, 7 the output can't be written or is there already,\n"
    "8 the answer is damaged or of another engine.\n"
    "\n"
    "Start here:\n"
    "  ccslice models ring -o ring.ccmesh\n"
    "  ccslice show ring.ccmesh --channel hardness\n"
    "  ccslice slice ring.ccmesh --pitch 0.2 --channel hardness -o ring\n"
    "\n"
    "`ccslice COMMAND --help` explains a command.";

int run(const CLI::App& app, const std::vector<Command>& commands, const CommonOptions& options) {
  client::Cancellation cancellation;
  const InterruptGuard guard(cancellation);
  try {
    Session session(options, cancellation);
    for (const Command& command : commands) {
      if (app.got_subcommand(command.app)) command.run(session);
    }
    return kExitOk;
  } catch (const std::exception& exception) {
    const Failure failure = failure_of(exception);
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
  CLI::App app("Slices Catmull-Clark solids into voxel layers, through a ccsliced server.", "ccslice");
  app.set_version_flag("--version", CCSLICE_VERSION);
  app.require_subcommand(1);
  app.footer(kFooter);
  CommonOptions options;
  google::protobuf::SetLogHandler(nullptr);  // What it has to say about hostile files, our errors say.
  const std::vector<Command> commands = {add_slice(app, options),   add_plan(app, options),   add_show(app, options),
                                         add_picture(app, options), add_probe(app, options),  add_info(app, options),
                                         add_upload(app, options),  add_export(app, options), add_package(app, options),
                                         add_models(app, options),  add_convert(app, options)};
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (app.exit(error) == 0) return kExitOk;
    if (wants_json(argc, argv)) print_error_document({kExitUsage, "USAGE", error.what()});
    return kExitUsage;
  }
  return flushed(run(app, commands, options));
}
