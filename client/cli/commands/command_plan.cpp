// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/job_options.h"
#include "client/cli/meshes/numbering.h"
#include "client/cli/output/documents.h"

namespace ccslice::cli {
namespace {

void run_plan(Session& session, const JobOptions& options) {
  v1::SliceJob job = job_of(options, {});
  const PartNumbers parts = put_on_server(session, options, job);
  const v1::PlanSlicesResponse plan = plan_of(session, options, job);
  const std::optional<FileNumbers> numbers = parts.size() == 1 ? parts.front() : std::nullopt;
  if (!session.options().json)
    return print_line(numbers ? describe(plan, *numbers) : describe(in_numbers_of_files(plan, parts)));
  v1::PlanDocument document = numbers ? document_of(renumbered(plan, *numbers), &*numbers)  //
                                      : document_of(in_numbers_of_files(plan, parts));
  const std::vector<std::string>& notes = session.file_notes();
  if (numbers) *document.mutable_notes() = {notes.begin(), notes.end()};
  print_line(json_of(document));
}

}  // namespace

Command add_plan(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<JobOptions>();
  CLI::App* app = parent.add_subcommand("plan", "Say what slicing would give: grid, layers, sizes, warnings");
  add_job_options(*app, *options, common);
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice plan ring.ccmesh --pitch 0.0423,0.0846,0.03\n  ccslice plan part.vtk --dpi 600,300 "
      "--layer-height 0.027 --rotate x=90\n  ccslice plan part.vtk --pitch 0.05 --box 10,10,0,30,20,4");
  return {app, [options](Session& session) { run_plan(session, *options); }};
}

}  // namespace ccslice::cli
