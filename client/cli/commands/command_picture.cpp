// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <cmath>
#include <cstdint>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/message_json.h"
#include "client/cli/base/option_group.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/commands/picture_fits.h"
#include "client/cli/commands/picture_options.h"
#include "client/cli/pictures/png_file.h"
#include "core/base/echo.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kMostPlanes = 200;

/// "hardness from 0.1 to 0.9", "soft 40 %, hard 60 %".
std::string legend_text(const PictureOptions& options, const DrawnPicture& drawn) {
  const v1::PreviewHeader& header = *drawn.header;
  const auto all = std::accumulate(header.material_pixels().begin(), header.material_pixels().end(), std::uint64_t{0});
  if (header.pixels_inside() == 0 && all == 0) {
    return drawn.materials.empty() ? "the plane misses the part" : "the plane misses what is printed";
  }
  if (header.has_range()) {
    return echoed(options.channel) + " from " + show_number(header.range().min()) + " to " +
           show_number(header.range().max()) + (options.terminal ? ", '.' to '@'" : "");
  }
  std::string text;
  for (int m = 0; m < header.material_pixels_size(); ++m) {
    const double share = static_cast<double>(header.material_pixels(m)) / static_cast<double>(all);
    text += (m == 0 ? "" : ", ") + echoed(drawn.materials[static_cast<std::size_t>(m)]) + " " +
            show_number(std::round(1000 * share) / 10) + " %";
  }
  return text.empty() ? "material at " + show_count(header.pixels_inside()) + " pixels" : text;
}

void add_legend(const v1::PreviewHeader& header, v1::PictureDocument& document) {
  document.set_across_mm_per_pixel(header.across_mm_per_pixel());
  document.set_up_mm_per_pixel(header.up_mm_per_pixel());
  document.set_pixels_inside(header.pixels_inside());
  if (header.has_range()) {
    document.add_range(header.range().min());
    document.add_range(header.range().max());
  }
  *document.mutable_material_pixels() = header.material_pixels();
}

void print_document(const PictureOptions& options, const DrawnPicture& drawn) {
  v1::PictureDocument document;
  if (options.terminal) {
    document.set_characters(drawn.bytes);
  } else {
    document.set_file(options.output);
    document.set_size_bytes(drawn.bytes.size());
  }
  if (drawn.width > 0) {
    document.set_width(drawn.width);
    document.set_height(drawn.height);
  }
  if (options.sweep > 0) document.set_planes(options.sweep);
  if (drawn.header) add_legend(*drawn.header, document);
  print_line(json_of(document));
}

void print_result(const PictureOptions& options, const DrawnPicture& drawn) {
  if (options.terminal) {
    return print_line(drawn.bytes + legend_text(options, drawn) + "; a character is " +
                      show_number(drawn.character_mm) + " mm wide");
  }
  std::string text = options.output + ": " + show_bytes(drawn.bytes.size());
  if (drawn.width > 0) text += ", " + std::to_string(drawn.width) + " x " + std::to_string(drawn.height);
  if (options.sweep > 0) text += ", " + std::to_string(options.sweep) + " planes";
  if (drawn.header) text += ", " + legend_text(options, drawn);
  print_line(text);
}

void run_picture(Session& session, const CLI::App& command, const PictureOptions& options) {
  const bool is_of_file = options.layer && !options.job.file.empty();
  v1::SliceJob job = is_of_file ? job_to_draw(options) : v1::SliceJob();
  check_fits(command, options, is_of_file ? job.has_printing() : !options.job.printing.materials.empty());
  if (!options.terminal) {
    if (options.output.empty()) throw UsageError("say where the picture goes: -o FILE.png, or --terminal");
    require_png_name(options.output);
  }
  if (!is_of_file) job = job_to_draw(options);
  options.in_space() ? check_space_options(options) : static_cast<void>(request_of(options, job));
  if (!options.terminal) refuse_to_overwrite(options.output, options.force);
  put_on_server(session, options.job, job);
  const DrawnPicture drawn =
      options.in_space() ? draw_in_space(session, options, job) : draw_planes(session, options, job);
  if (!options.terminal) write_file(options.output, drawn.bytes);
  session.options().json ? print_document(options, drawn) : print_result(options, drawn);
}

void add_cut_options(CLI::App& app, PictureOptions& options) {
  const OptionGroup group(app, "A cut");
  app.add_option("--plane", options.plane,
                 "Draw what is on this plane: an axis and a place in mm, as in z=12.5, or a point and a normal, "
                 "X,Y,Z:NX,NY,NZ");
  app.add_option("--layer", options.layer,
                 "Draw this layer of a job, voxel by voxel as it is sliced; --pitch or --printer give its grid");
  app.add_option("--sweep", options.sweep,
                 "Cut this often, evenly through the part along the plane's normal (default: z), and write a contact "
                 "sheet")
      ->check(CLI::Range(1u, kMostPlanes));
  app.add_option("--show", options.show,
                 "What the pixels show: occupancy; channel, through a colour map; mix, the materials' mixed colour; "
                 "halftone, the materials as they print (default: what --channel or --material suggest)")
      ->check(CLI::IsMember({"occupancy", "channel", "mix", "halftone"}));
  app.add_option("--colours", options.colours, "The channel's colour map")
      ->check(CLI::IsMember({"viridis", "cividis", "grey"}))
      ->capture_default_str();
  app.add_option("--range", options.range,
                 "MIN,MAX: values of the first and the last colour (default: those in the picture; of a sweep, those "
                 "of the mesh)");
  app.add_option("--lines", options.lines, "Draw the outlines of the cut on top, this many pixels wide")
      ->check(CLI::Range(0.25, 16.0));
  app.add_flag("--animate", options.animate, "Write the sweep as an animated PNG file, which browsers play");
  app.add_option("--frame-ms", options.frame_ms, "How long each picture of the animation stands")
      ->check(CLI::Range(10u, 10'000u))
      ->capture_default_str();
}

void add_space_options(CLI::App& app, PictureOptions& options) {
  const OptionGroup group(app, "The part in space");
  app.add_option("--cut", options.cuts,
                 "AXIS=FRACTION: cut away the viewer's side of a plane across x, y or z, at a fraction of the part's "
                 "extent from 0 to 1. May be repeated: then only what is on that side of all planes is cut away")
      ->allow_extra_args(false);
  app.add_option("--view", options.view,
                 "AZIMUTH,ELEVATION: where the viewer stands, in degrees from +x towards +y and above the horizon "
                 "(default: -60,30)");
  app.add_flag("--cell-regions", options.cell_regions,
               "Give each cell region a colour instead (--regions-from makes regions)");
  app.add_flag("--no-legend", options.no_legend,
               "Leave out what stands below the picture: the bar of colours with numbers, or the names of materials or "
               "cell regions");
  constexpr std::uint32_t kCoarsest = 8, kFinest = 600;
  app.add_option("--voxels", options.voxels, "Voxels along the part's longest side: more give a finer picture")
      ->check(CLI::Range(kCoarsest, kFinest))
      ->capture_default_str();
}

}  // namespace

Command add_picture(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<PictureOptions>();
  CLI::App* app = parent.add_subcommand(
      "picture", "Draw a part in space, a cut along any plane, a layer or a sweep: a PNG file, or the terminal");
  add_placed_job_options(*app, options->job, common);
  app->add_option("--channel", options->channel, "Colour by this material channel");
  app->add_option("--pixels", options->given_pixels,
                  "Pixels along the longer side, or the width of the part in space; in a terminal characters across, "
                  "by default " +
                      std::to_string(PictureOptions::kTerminalWidth))
      ->check(CLI::Range(8u, kMostPicturePixels))
      ->default_str(std::to_string(PictureOptions::kPixels));
  app->add_option("-o,--output", options->output, "File to write, NAME.png");
  app->add_flag("--terminal", options->terminal,
                "Draw with characters instead: the cut of --plane or --layer, or else one half-way up");
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_cut_options(*app, *options);
  add_space_options(*app, *options);
  add_server_options(*app, common);
  describe_fits(*app);
  app->footer(
      "Examples:\n  ccslice picture engine.ccmesh --channel hardness --cut y=0.5 -o engine.png\n"
      "  ccslice picture engine.ccmesh --channel hardness --terminal\n"
      "  ccslice picture engine.ccmesh --plane 0,0,10:1,0,1 --channel hardness --colours cividis -o oblique.png\n"
      "  ccslice picture engine.ccmesh --sweep 60 --animate --channel hardness -o sweep.png\n"
      "  ccslice picture engine.ccmesh --layer 300 --printer j750-hq --material soft=#ffd700 --material hard=#202080 "
      "--map blend:hardness:0=soft,1=hard -o layer.png\n"
      "  ccslice picture --job tray.json --layer 300 -o layer.png");
  return {app, [app, options](Session& session) { run_picture(session, *app, *options); }};
}

}  // namespace ccslice::cli
