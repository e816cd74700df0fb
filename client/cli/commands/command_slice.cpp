// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/job_options.h"
#include "client/cli/options/job_share.h"
#include "client/cli/output/grabcad.h"
#include "client/cli/output/layer_folder.h"
#include "client/cli/output/layer_stream.h"
#include "client/cli/output/slice_report.h"
#include "client/cli/pictures/contact_sheet.h"
#include "client/cli/pictures/png_file.h"
#include "client/client_error.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

constexpr unsigned kMostStreams = 64;

struct SliceOptions {
  JobOptions job;
  std::string output;
  std::string layers;
  std::optional<std::string> share;
  std::optional<std::string> contours;  // Unset: none, or JSON if the job's file has contours.
  bool contours_by_cell_region = false;
  unsigned split = 1;
  bool no_contact_sheet = false;
  bool force = false;
  bool resume = false;

  bool to_stdout() const { return output == "-"; }
};

ContourFiles contour_files_of(const SliceOptions& options) {
  const std::map<std::string_view, ContourFormat> formats = {
      {"json", ContourFormat::kJson}, {"csv", ContourFormat::kCsv}, {"svg", ContourFormat::kSvg}};
  if (const auto format = formats.find(options.contours.value_or("")); format != formats.end()) {
    return {format->second, options.contours_by_cell_region, {}};
  }
  if (options.contours_by_cell_region)
    throw UsageError("--contours-by-cell-region goes with --contours json, csv or svg");
  return {};
}

/// What the plan of a job for GrabCAD doesn't say.
void warn_of_grabcad(const v1::SliceJob& job, const v1::PlanSlicesResponse& plan) {
  if (const std::string unknown = unknown_resins(job.printing()); !unknown.empty()) print_note("warning: " + unknown);
  if (job.has_printer()) return;
  print_note("note: without --printer nothing compares this job with a printer's pitch, tray and materials");
  if (plan.layer_count() < kFewestGrabcadLayers) {
    print_note("warning: GrabCAD takes no fewer than " + std::to_string(kFewestGrabcadLayers) +
               " layers, and there are " + std::to_string(plan.layer_count()));
  }
}

LayerRange layer_range(const SliceOptions& options, const v1::PlanSlicesResponse& plan) {
  const std::uint32_t first = client::region_of(plan).first_layer(), last = first + plan.layer_count() - 1;
  if (options.layers.empty()) return {first, last};
  const LayerRange range = parse_layer_range("--layers", options.layers);
  if (range.first < first || range.last > last) {
    throw UsageError("--layers " + options.layers + ": this job has layers " + std::to_string(first) + " to " +
                     std::to_string(last));
  }
  return range;
}

v1::SliceRangeRequest slice_request(const v1::SliceJob& job, const LayerRange& range) {
  v1::SliceRangeRequest request;
  *request.mutable_job() = job;
  request.set_first_layer(range.first);
  request.set_layer_count(range.last - range.first + 1);
  return request;
}

/// What is left of the job after the layers that are there already.
v1::SliceRangeRequest rest_of(const v1::SliceRangeRequest& request, const client::SliceOutcome& finished) {
  const auto layers = static_cast<std::uint32_t>(finished.layers);
  v1::SliceRangeRequest rest = request;
  rest.set_first_layer(request.first_layer() + layers);
  rest.set_layer_count(request.layer_count() - layers);
  return rest;
}

/// Writes every layer as it comes. Says what is there if not all of them come.
client::SliceOutcome slice_into(Session& session, const v1::SliceRangeRequest& request, client::SlicePin& pin,
                                LayerSink& sink, const SliceOptions& options) {
  std::uint64_t done = sink.finished().layers;
  if (done > 0 && !session.quiet()) print_note("note: " + show_count(done) + " layers were there already");
  try {
    Progress progress("slicing", "layers", request.layer_count(), session.quiet());
    const auto on_layer = [&](const v1::SliceHeader&, const client::Layer& layer) {
      sink.write(layer);
      progress.update(++done);
    };
    client::CallOptions call = session.call();
    call.split = options.split;
    client::SliceOutcome outcome = session.client().slice(rest_of(request, sink.finished()), on_layer, call, &pin);
    outcome.add_counts(sink.finished());
    return outcome;
  } catch (const std::exception&) {
    if (done > 0 && !session.quiet()) {
      print_note("note: " + show_count(done) + " of " + show_count(request.layer_count()) + " layers are in " +
                 place_of(options.output) + "; there is no manifest.json, since the job isn't complete" +
                 (options.to_stdout() ? "" : ": --resume goes on with it"));
    }
    throw;
  }
}

/// The path of the sheet. A job whose layers are all there doesn't fail for want of it: a server may stop right then.
std::string write_contact_sheet(Session& session, const v1::SliceRangeRequest& request, const v1::SliceHeader& header,
                                LayerSink& sink) {
  try {
    return sink.write_contact_sheet(to_png(contact_sheet(session, request, header)));
  } catch (const client::ClientError& error) {
    if (error.reason() == client::local_reason::kCancelledHere) throw;
    if (!session.quiet()) print_note("note: there is no contact sheet: " + echoed(error.what(), kMaxMessageBytes));
    return {};
  }
}

/// What -o - can't be combined with.
void require_stream(const Session& session, const SliceOptions& options) {
  if (options.resume) throw UsageError("--resume goes on in a folder; -o - writes to standard output, from the start");
  if (session.options().json) throw UsageError("-o - takes standard output for the layers; leave out --json");
  if (isatty(STDOUT_FILENO) != 0) {
    throw UsageError("-o - writes files to standard output, which is a terminal: send it to a program or to a file");
  }
}

/// One file if there is no other: that of one layer which is asked for. A share needs its manifest.
StreamForm stream_form_of(const SliceOptions& options, const v1::SliceRangeRequest& request) {
  const int files = request.job().planes_size() + (request.job().has_contours() ? 1 : 0);
  const bool one = !options.layers.empty() && !options.share && request.layer_count() == 1 && files == 1;
  return one ? StreamForm::kOneFile : StreamForm::kArchive;
}

Existing existing_of(const SliceOptions& options) {
  return options.force ? Existing::kReplace : options.resume ? Existing::kResume : Existing::kRefuse;
}

/// Of shares, the first one has it, and shows the whole job.
bool wants_contact_sheet(const SliceOptions& options, const PlannedJob& job, const LayerSink& sink) {
  const bool has_it = !job.key.share || job.key.share->share.number == 1;
  return has_it && !options.no_contact_sheet && sink.takes_contact_sheet();
}

/// Has the layers sliced into the sink, and says how that went.
void slice_job(Session& session, const SliceOptions& options, const PlannedJob& job, LayerSink& sink) {
  client::SlicePin pin{job.plan.engine_version(), job.plan.grid()};
  const auto start = std::chrono::steady_clock::now();
  SliceResult result;
  result.outcome = slice_into(session, job.request, pin, sink, options);
  result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (wants_contact_sheet(options, job, sink)) {
    result.contact_sheet = write_contact_sheet(session, job.whole, result.outcome.header, sink);
  }
  sink.finish(result.outcome, job.request.job(), job.plan);
  result.written_bytes = sink.written_bytes();
  report_sliced(session, options.output, job, result);
  if (session.quiet()) return;
  if (job.layers() == job.plan.layer_count()) warn_of_materials(result.outcome);
  warn_of_covered(job.request.job(), result.outcome);
}

/// The outlines that the job's file asks for, in the form of the options: JSON if they don't say, and left out of the
/// job if they say none.
ContourFiles take_contours_of_file(v1::SliceJob& job, SliceOptions& options) {
  if (options.contours == "none") {
    if (job.planes().empty()) {
      throw UsageError("--contours none leaves nothing of the job of " + options.job.file +
                       ", which has no planes; leave it out");
    }
    job.clear_contours();
  }
  if (job.has_contours() && !options.contours) options.contours = "json";
  ContourFiles contours = contour_files_of(options);
  if (!job.has_contours() && contours.format != ContourFormat::kNone) {
    throw UsageError("--contours: the job of " + options.job.file + " has none; add \"contours\": {} to it");
  }
  contours.by_region = job.contours().by_cell_region();
  return contours;
}

/// The plan of the job in the file's numbers, whose warnings are told.
v1::PlanSlicesResponse told_plan(Session& session, const SliceOptions& options, const v1::SliceJob& job,
                                 const PartNumbers& numbers) {
  const v1::PlanSlicesResponse plan = in_numbers_of_files(plan_of(session, options.job, job), numbers);
  if (session.quiet()) return plan;
  for (const v1::PlanWarning& warning : plan.warnings()) {
    print_note("warning: " + echoed(warning.message(), kMaxMessageBytes));
  }
  if (plan.snapped().copies() > 0) print_note("note: copies: " + describe(plan.snapped()));
  if (options.job.software == "grabcad") warn_of_grabcad(job, plan);
  return plan;
}

PlannedJob plan_job(Session& session, const SliceOptions& options, const v1::SliceJob& message,
                    const PartNumbers& numbers) {
  PlannedJob job;
  job.plan = told_plan(session, options, message, numbers);
  const LayerRange layers = layer_range(options, job.plan);
  job.whole = job.request = slice_request(message, layers);
  job.key = job_key_of(job.whole, job.plan, options.contours.value_or("none") + options.job.software);
  if (!options.share) return job;
  const Share share = parse_share("--share", *options.share);
  const LayerRange own = layers_of_share(share, layers);
  job.request = slice_request(message, own);
  job.key = job_key_of(ShareRecord{share, own, job.key.id, layers}, job.key.files_of_layer);
  return job;
}

void run_slice(Session& session, SliceOptions options) {
  ContourFiles contours = contour_files_of(options);
  const bool for_grabcad = options.job.software == "grabcad";
  if (for_grabcad && contours.format != ContourFormat::kNone) {
    throw UsageError("--format grabcad writes pictures only; leave out --contours");
  }
  v1::SliceJob message = job_of(options.job, contours);
  if (!options.job.file.empty()) contours = take_contours_of_file(message, options);
  if (!options.layers.empty()) parse_layer_range("--layers", options.layers);
  if (options.share) parse_share("--share", *options.share);
  options.to_stdout() ? require_stream(session, options) : refuse_used_folder(options.output, existing_of(options));
  const PartNumbers numbers = put_on_server(session, options.job, message);
  const PlannedJob job = plan_job(session, options, message, numbers);
  contours.by_part = message.parts_size() > 1 || message.parts(0).placements_size() > 1;
  const v1::Grid& grid = job.plan.grid();
  contours.box_mm = {grid.origin_mm().x(), grid.origin_mm().y(), grid.extent().columns() * grid.pitch().x_mm(),
                     grid.extent().rows() * grid.pitch().y_mm()};
  const LayerFiles files({message.planes().begin(), message.planes().end()}, contours, grid.extent().layers(),
                         for_grabcad ? grabcad_names(client::region_of(job.plan).first_layer()) : LayerNames());
  if (options.to_stdout()) {
    LayerStream stream(stdout, stream_form_of(options, job.request), files, job.key);
    return slice_job(session, options, job, stream);
  }
  if (options.resume && holds_whole_job(options.output, job.key)) {
    if (!session.quiet()) print_note("note: nothing is left to do, this job is complete");
    return report_complete(session, options.output, job);
  }
  LayerFolder folder(options.output, files, existing_of(options), job.key);
  slice_job(session, options, job, folder);
}

}  // namespace

Command add_slice(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<SliceOptions>();
  CLI::App* app = parent.add_subcommand("slice", "Slice a mesh and write its layers to a folder");
  add_job_options(*app, options->job, common);
  app->add_option(
         "-o,--output", options->output,
         "Folder for the layers, a contact sheet of them and manifest.json, which is written last; - for standard "
         "output: a tar archive of such a folder, or the one file if --layers names one layer that has but one")
      ->required();
  app->add_option(
      "--layers", options->layers,
      "FIRST..LAST, both included, or one layer, counted from 0 in the grid (default: all layers of the job)");
  app->add_option("--share", options->share,
                  "I/N: slice share I of N only, from 1/N to N/N. Shares are cut at the same layers for everybody who "
                  "asks; ccslice join makes the job of their folders");
  app->add_option("--contours", options->contours, "Write the outlines too: json, csv, or svg, which programs draw")
      ->check(CLI::IsMember({"none", "json", "csv", "svg"}))
      ->default_str("none")
      ->group("Pictures");
  app->add_flag("--contours-by-cell-region", options->contours_by_cell_region,
                "Write the outlines of each cell region by itself, interfaces included")
      ->group("Pictures");
  options->job.said_in_files.push_back(app->get_option("--contours-by-cell-region"));
  app->add_flag("--no-contact-sheet", options->no_contact_sheet,
                "Leave out contact_sheet.png, a picture of up to 24 of the layers");
  CLI::Option* force = app->add_flag("--force", options->force, "Replace the layers of an earlier run");
  app->add_flag("--resume", options->resume,
                "Go on with the same job where an earlier run stopped, or start it if there was none")
      ->excludes(force);
  add_server_options(*app, common);
  app->add_option("--split", options->split,
                  "Have so many of the servers of --server slice at once, each a block of layers after the other")
      ->check(CLI::Range(1u, kMostStreams))
      ->capture_default_str()
      ->group("Server");
  app->footer(
      "Examples:\n  ccslice slice ring.ccmesh --pitch 0.0423,0.0846,0.03 --channel hardness -o ring\n"
      "  ccslice slice part.vtk --grade stiffness=z --dpi 600,300 --layer-height 0.027 "
      "--occupancy --channel stiffness:u16 --layers 100..199 -o graded\n"
      "  ccslice slice part.mesh --pitch 0.1 --rotate x=90 --translate=0,0,5 --contours json -o turned\n"
      "  ccslice slice part.mesh --pitch 0.05 --box 10,10,0,30,20,4 --row-order descending -o corner\n"
      "  ccslice slice part.mesh --pitch 0.1 --share 2/8 --resume -o part-2\n"
      "  ccslice slice part.mesh --pitch 0.1 -o - >layers.tar\n"
      "  ccslice slice body.vtk lid.vtk --at 0,0,0 --at 40,0,0 --pitch 0.1 --write-job tray.json -o tray\n"
      "  ccslice slice --job tray.json body.vtk lid.vtk -o again");
  return {app, [options](Session& session) { run_slice(session, *options); }};
}

}  // namespace ccslice::cli
