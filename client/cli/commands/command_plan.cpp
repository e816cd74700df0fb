// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdint>
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
#include "client/cli/output/job_costs.h"

namespace ccslice::cli {
namespace {

struct PlanOptions {
  JobOptions job;
  bool costs = false;
};

/// Slices some layers, with progress.
JobCosts costs_of(Session& session, const v1::SliceJob& job, const v1::PlanSlicesResponse& plan) {
  const std::vector<LayerSample> samples = layers_to_sample(client::region_of(plan).first_layer(), plan.layer_count());
  std::uint64_t total = 0, done = 0;
  for (const LayerSample& sample : samples) total += sample.layer_count;
  Progress progress("sampling", "layers", total, session.quiet());
  client::SlicePin pin{plan.engine_version(), plan.grid()};
  v1::SliceRangeRequest request;
  *request.mutable_job() = job;
  JobCosts costs;
  for (const LayerSample& sample : samples) {
    request.set_first_layer(sample.first_layer);
    request.set_layer_count(sample.layer_count);
    const auto on_layer = [&](const v1::SliceHeader&, const client::Layer&) { progress.update(++done); };
    costs.add(sample, session.client().slice(request, on_layer, session.call(), &pin));
  }
  return costs;
}

void run_plan(Session& session, const PlanOptions& all) {
  const JobOptions& options = all.job;
  v1::SliceJob job = job_of(options, {});
  const PartNumbers parts = put_on_server(session, options, job);
  const v1::PlanSlicesResponse plan = plan_of(session, options, job);
  const std::optional<FileNumbers> numbers = parts.size() == 1 ? parts.front() : std::nullopt;
  const std::optional<JobCosts> costs =
      all.costs ? std::optional(costs_of(session, job, plan)) : std::optional<JobCosts>();
  if (!session.options().json) {
    const std::string text = numbers ? describe(plan, *numbers) : describe(in_numbers_of_files(plan, parts));
    return print_line(text + (costs ? costs->text(job) : ""));
  }
  v1::PlanDocument document = numbers ? document_of(renumbered(plan, *numbers), &*numbers)  //
                                      : document_of(in_numbers_of_files(plan, parts));
  const std::vector<std::string>& notes = session.file_notes();
  if (numbers) *document.mutable_notes() = {notes.begin(), notes.end()};
  if (costs) *document.mutable_costs() = costs->document(job);
  print_line(json_of(document));
}

}  // namespace

Command add_plan(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* app = parent.add_subcommand("plan", "Say what slicing would give: grid, layers, sizes, warnings");
  add_job_options(*app, options->job, common);
  app->add_flag(
      "--costs", options->costs,
      "Slice up to 256 of the layers, too, and estimate the volume of each material and the size of the pictures");
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice plan ring.ccmesh --pitch 0.0423,0.0846,0.03\n  ccslice plan part.vtk --dpi 600,300 "
      "--layer-height 0.027 --rotate x=90\n  ccslice plan part.vtk --pitch 0.05 --box 10,10,0,30,20,4\n  ccslice plan "
      "tray.json --costs");
  return {app, [options](Session& session) { run_plan(session, *options); }};
}

}  // namespace ccslice::cli
