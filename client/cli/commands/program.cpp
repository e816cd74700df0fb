// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "client/cli/commands/program.h"

#include <memory>
#include <utility>

#include "client/cli/commands/help.h"
#include "core/base/version.h"

namespace ccslice::cli {
namespace {

constexpr const char* kFooter =
    "Exit codes: 0 done, 2 wrong command line, 3 an input file is at fault, 4 the server refused, "
    "5 no server or not in time, 6 interrupted, 7 the output can't be written or is there already, "
    "8 the answer is damaged or of another engine.\n"
    "\n"
    "Start here:\n"
    "  ccslice models ring -o ring.ccmesh\n"
    "  ccslice picture ring.ccmesh --channel hardness --terminal\n"
    "  ccslice slice ring.ccmesh --pitch 0.2 --channel hardness -o ring\n"
    "\n"
    "`ccslice help COMMAND` explains a command.";

}  // namespace

Program::Program() : app("Slices Catmull-Clark solids into voxel layers, through a ccsliced server.", "ccslice") {
  app.set_version_flag("--version", kVersion);
  app.require_subcommand(1);
  app.footer(kFooter);
  app.formatter(std::make_shared<HelpFormatter>(help_columns()));
  commands = {add_slice(app, options),   add_join(app, options),     add_plan(app, options),
              add_picture(app, options), add_probe(app, options),    add_info(app, options),
              add_upload(app, options),  add_export(app, options),   add_package(app, options),
              add_models(app, options),  add_printers(app, options), add_convert(app, options),
              add_view(app, options)};
  for (Command& command : add_tray(app, options)) commands.push_back(std::move(command));
}

}  // namespace ccslice::cli
