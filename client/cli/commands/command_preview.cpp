// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/json.h"
#include "client/cli/base/output_file.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/commands.h"
#include "client/cli/meshes/mesh_source.h"
#include "client/cli/options/cut_plane.h"
#include "client/cli/options/job.h"
#include "client/cli/options/part_box.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"
#include "client/cli/pictures/animated_png.h"
#include "client/cli/pictures/contact_sheet.h"
#include "client/cli/pictures/pixel_font.h"
#include "client/cli/pictures/png_file.h"
#include "client/preview.h"
#include "core/base/echo.h"
#include "core/output/png.h"

namespace ccslice::cli {
namespace {

constexpr std::uint32_t kMostPixels = 2048, kMostPlanes = 200;

struct PreviewOptions {
  MeshOptions mesh;
  GridOptions grid;
  PlacementOptions placement;
  PrintingOptions printing;
  std::string plane, show, channel, colours = "viridis", range, output;
  std::optional<std::uint32_t> layer;
  std::uint32_t pixels = 512, sweep = 0, frame_ms = 80;
  std::optional<double> lines;
  bool animate = false, force = false;
};

v1::ColourMapName to_colour_map(const std::string& name) {
  if (name == "cividis") return v1::COLOUR_MAP_NAME_CIVIDIS;
  if (name == "grey") return v1::COLOUR_MAP_NAME_GREY;
  return v1::COLOUR_MAP_NAME_VIRIDIS;
}

/// What is shown where the options don't say.
std::string what_to_show(const PreviewOptions& options) {
  if (!options.show.empty()) return options.show;
  if (!options.channel.empty()) return "channel";
  if (options.printing.materials.empty()) return "occupancy";
  return options.layer ? "halftone" : "mix";
}

void set_content(const PreviewOptions& options, v1::PreviewRequest& request) {
  const std::string show = what_to_show(options);
  if (options.printing.materials.empty() && (show == "mix" || show == "halftone")) {
    throw UsageError("--show " + show +
                     " shows materials: name them, --material NAME=#RRGGBB, and how they mix, --map");
  }
  v1::PreviewContent& content = *request.mutable_content();
  if (options.lines) content.mutable_lines()->set_width_pixels(*options.lines);
  if (show == "occupancy") content.mutable_occupancy();
  if (show == "mix") content.mutable_mix();
  if (show == "halftone") {
    v1::HalftoneContent& halftone = *content.mutable_halftone();
    if (!options.layer) *halftone.mutable_grid() = parse_grid(options.grid);
    if (!options.layer && !options.grid.printer.empty()) halftone.mutable_printer()->set_name(options.grid.printer);
  }
  if (show != "channel") return;
  if (options.channel.empty()) throw UsageError("--show channel: say which one, --channel NAME");
  content.mutable_channel()->set_channel(options.channel);
  content.mutable_channel()->set_colours(to_colour_map(options.colours));
  if (options.range.empty()) return;
  const std::vector<double> range = parse_numbers("--range", options.range, 2, 2);
  content.mutable_channel()->mutable_range()->set_min(range[0]);
  content.mutable_channel()->mutable_range()->set_max(range[1]);
}

/// The request; that of a free plane lacks the plane.
v1::PreviewRequest request_of(const PreviewOptions& options, const std::string& mesh_id) {
  v1::PreviewRequest request;
  set_content(options, request);
  if (options.layer) {
    v1::PreviewLayer& layer = *request.mutable_plane()->mutable_layer();
    layer.set_layer(*options.layer);
    *layer.mutable_job() = parse_job(options.grid, options.placement, options.printing);
    layer.mutable_job()->mutable_parts(0)->set_mesh_id(mesh_id);
    return request;
  }
  request.set_mesh_id(mesh_id);
  *request.mutable_placement() = parse_placement(options.placement);
  const std::optional<v1::Printing> printing = parse_printing(options.printing);
  if (printing) *request.mutable_printing() = *printing;
  return request;
}

void set_plane(const FramedCut& framed, v1::PreviewRequest& request) {
  *request.mutable_plane()->mutable_free() = framed.plane;
  request.set_width(framed.width);
  request.set_height(framed.height);
}

/// Draws a picture of 4 bytes a pixel over what is there.
void draw(const client::PreviewPicture& preview, int left, int top, Picture& picture) {
  const auto* rgba = reinterpret_cast<const std::uint8_t*>(preview.bytes.data());
  for (std::uint32_t y = 0; y < preview.header.height(); ++y) {
    for (std::uint32_t x = 0; x < preview.header.width(); ++x, rgba += 4) {
      if (rgba[3] == 0) continue;
      const double opaque = rgba[3] / 255.0;  // Lines are so in part, beside the part; the sheet is white.
      set_colour(left + static_cast<int>(x), top + static_cast<int>(y),
                 opaque * to_colour({rgba[0], rgba[1], rgba[2]}) + Colour::Constant(1 - opaque), picture);
    }
  }
}

/// The range of all pictures of a sweep is one, or colours would change their meaning from one to the next.
void fix_range(Session& session, const PreviewOptions& options, v1::PreviewRequest& request) {
  if (!request.content().has_channel() || request.content().channel().has_range()) return;
  const v1::MeshSummary mesh = session.client().mesh_summary(request.mesh_id(), session.call());
  for (const v1::Channel& channel : mesh.channels()) {
    if (channel.name() != options.channel || !(channel.min_value() < channel.max_value())) continue;
    request.mutable_content()->mutable_channel()->mutable_range()->set_min(channel.min_value());
    request.mutable_content()->mutable_channel()->mutable_range()->set_max(channel.max_value());
  }
}

/// Sends a request for each of the planes, and calls take(i, picture) as their pictures come. Each waits for the one
/// before: a newer request would put an older one aside.
template <typename Take>
void for_planes(Session& session, v1::PreviewRequest request, const std::vector<FramedCut>& planes, const Take& take) {
  Progress progress("drawing", "planes", planes.size(), session.quiet());
  client::PreviewStream stream(session.client(), request.mesh_id(), session.call());
  for (std::size_t i = 0; i < planes.size(); ++i) {
    set_plane(planes[i], request);
    stream.ask(request);
    std::optional<client::PreviewPicture> picture = stream.next();
    if (!picture) client::answer_corrupt("the server ended the pictures early");
    take(i, std::move(*picture));
    progress.update(i + 1);
  }
  stream.done();
}

std::string sweep_of(Session& session, const PreviewOptions& options, v1::PreviewRequest request, const v1::Box3& box) {
  const CutPlane plane = parse_cut_plane(options.plane.empty() ? "z=0" : options.plane);
  const int count = static_cast<int>(options.sweep);
  const FramedCut whole = frame_cut(plane, box, options.pixels);
  const SheetLayout layout = lay_out_sheet(count, whole.width, whole.height);
  const auto longer = static_cast<std::uint32_t>(std::max(layout.tile_width, layout.tile_height));
  const std::uint32_t pixels = options.animate ? options.pixels : std::clamp(longer, 16u, kMostPixels);
  std::vector<FramedCut> planes;
  std::vector<double> heights;
  for (int i = 0; i < count; ++i) {
    const CutPlane moved = moved_to(plane, box, (i + 0.5) / count);
    planes.push_back(frame_cut(moved, box, pixels));
    heights.push_back(height_of(moved));
  }
  fix_range(session, options, request);
  request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
  if (options.animate) {
    std::vector<std::string> frames;
    PngEncoder encoder;
    for_planes(session, request, planes, [&](std::size_t, const client::PreviewPicture& picture) {
      const auto* rgba = reinterpret_cast<const std::uint8_t*>(picture.bytes.data());
      const std::vector<std::uint8_t> frame =
          encoder.true_colours(picture.header.width(), picture.header.height(), {rgba, picture.bytes.size()}, {});
      frames.emplace_back(frame.begin(), frame.end());
    });
    return animated_png(frames, static_cast<std::uint16_t>(options.frame_ms));
  }
  constexpr int kGap = 8, kCaption = 16;
  const int width = static_cast<int>(planes.front().width), height = static_cast<int>(planes.front().height);
  const int rows = (count + layout.columns - 1) / layout.columns;
  Picture sheet = blank_picture(kGap + layout.columns * (width + kGap), kGap + rows * (height + kCaption + kGap));
  for_planes(session, request, planes, [&](std::size_t i, client::PreviewPicture&& picture) {
    const int left = kGap + static_cast<int>(i) % layout.columns * (width + kGap);
    const int top = kGap + static_cast<int>(i) / layout.columns * (height + kCaption + kGap);
    draw(picture, left, top, sheet);
    draw_text(show_number(heights[i]) + " mm", left, top + height + 4, sheet, 1);
  });
  return to_png(sheet);
}

/// "hardness from 0.1 to 0.9", "soft 40 %, hard 60 %".
std::string legend_text(const PreviewOptions& options, const v1::PreviewHeader& header) {
  if (header.pixels_inside() == 0) return "the plane misses the part";
  if (header.has_range()) {
    return echoed(options.channel) + " from " + show_number(header.range().min()) + " to " +
           show_number(header.range().max());
  }
  std::string text;
  for (int m = 0; m < header.material_pixels_size(); ++m) {
    const double share = static_cast<double>(header.material_pixels(m)) / static_cast<double>(header.pixels_inside());
    const std::string& material = options.printing.materials[static_cast<std::size_t>(m)];
    text += (m == 0 ? "" : ", ") + echoed(material.substr(0, material.find('='))) + " " +
            show_number(std::round(1000 * share) / 10) + " %";
  }
  return text.empty() ? "material at " + show_count(header.pixels_inside()) + " pixels" : text;
}

void add_legend(const v1::PreviewHeader& header, JsonWriter& json) {
  json.member("width", header.width()).member("height", header.height());
  json.member("across_mm_per_pixel", header.across_mm_per_pixel());
  json.member("up_mm_per_pixel", header.up_mm_per_pixel());
  json.member("pixels_inside", header.pixels_inside());
  if (header.has_range()) {
    json.key("range").begin_array().value(header.range().min()).value(header.range().max()).end_array();
  }
  if (header.material_pixels_size() > 0) {
    json.key("material_pixels").begin_array();
    for (const std::uint64_t pixels : header.material_pixels()) json.value(pixels);
    json.end_array();
  }
}

void check_options(const PreviewOptions& options) {
  if (options.layer && !options.plane.empty()) throw UsageError("--plane or --layer: one of the two");
  if (options.layer && options.sweep > 0) throw UsageError("--sweep goes along a plane's normal: leave --layer out");
  if (!options.layer && options.plane.empty() && options.sweep == 0) {
    throw UsageError("say where to cut: --plane z=12.5, --plane X,Y,Z:NX,NY,NZ, --layer K, or --sweep N");
  }
  if (options.animate && options.sweep == 0) throw UsageError("--animate shows a sweep: --sweep N planes");
  require_png_name(options.output);
  if (!options.plane.empty()) parse_cut_plane(options.plane);
}

void run_preview(Session& session, const PreviewOptions& options) {
  check_options(options);
  request_of(options, "");  // Says what is wrong before anything is uploaded.
  refuse_to_overwrite(options.output, options.force);
  const std::string id = ensure_on_server(session, options.mesh, options.placement);
  v1::PreviewRequest request = request_of(options, id);
  std::string png;
  std::optional<v1::PreviewHeader> header;
  if (options.sweep > 0) {
    png = sweep_of(session, options, request, part_box(session, id, request.placement()));
  } else {
    if (!options.layer) {
      const v1::Box3 box = part_box(session, id, request.placement());
      set_plane(frame_cut(parse_cut_plane(options.plane), box, options.pixels), request);
    }
    client::PreviewPicture picture = session.client().preview(request, session.call());
    png = std::move(picture.bytes);
    header = std::move(picture.header);
  }
  write_file(options.output, png);
  if (session.options().json) {
    JsonWriter json;
    json.begin_object().member("file", options.output).member("size_bytes", png.size());
    if (header) add_legend(*header, json);
    return print_line(json.end_object().text());
  }
  std::string text = options.output + ": " + show_bytes(png.size());
  if (header) {
    text += ", " + std::to_string(header->width()) + " x " + std::to_string(header->height()) + ", " +
            legend_text(options, *header);
  } else {
    text += ", " + std::to_string(options.sweep) + " planes";
  }
  print_line(text);
}

}  // namespace

Command add_preview(CLI::App& parent, CommonOptions& common) {
  auto options = std::make_shared<PreviewOptions>();
  CLI::App* app = parent.add_subcommand("preview", "Write a picture of a cut along any plane, or of a layer");
  add_mesh_options(*app, options->mesh);
  app->add_option("--plane", options->plane,
                  "Where to cut: an axis and a place in mm, as in z=12.5, or a point and a normal, X,Y,Z:NX,NY,NZ");
  app->add_option(
      "--layer", options->layer,
      "Show this layer of a job instead, voxel by voxel as it is sliced; --pitch or --profile give its grid");
  app->add_option("--show", options->show,
                  "What the pixels show: occupancy; channel, through a colour map; mix, the materials' mixed colour; "
                  "halftone, the materials as they print (default: what --channel or --material suggest)")
      ->check(CLI::IsMember({"occupancy", "channel", "mix", "halftone"}));
  app->add_option("--channel", options->channel, "The channel to show");
  app->add_option("--colours", options->colours, "The channel's colour map")
      ->check(CLI::IsMember({"viridis", "cividis", "grey"}))
      ->capture_default_str();
  app->add_option("--range", options->range,
                  "MIN,MAX: values of the first and the last colour (default: those in the picture; of a sweep, those "
                  "of the mesh)");
  app->add_option("--lines", options->lines, "Draw the outlines of the cut on top, this many pixels wide")
      ->check(CLI::Range(0.25, 16.0));
  app->add_option("--pixels", options->pixels, "Pixels along the longer side")
      ->check(CLI::Range(8u, kMostPixels))
      ->capture_default_str();
  app->add_option("--sweep", options->sweep,
                  "Cut this often instead, evenly through the part along the plane's normal (default: z), and write a "
                  "contact sheet")
      ->check(CLI::Range(1u, kMostPlanes));
  app->add_flag("--animate", options->animate, "Write the sweep as an animated PNG file, which browsers play");
  app->add_option("--frame-ms", options->frame_ms, "How long each picture of the animation stands")
      ->check(CLI::Range(10u, 10'000u))
      ->capture_default_str();
  app->add_option("-o,--output", options->output, "File to write")->required();
  app->add_flag("--force", options->force, "Replace the file if it is there");
  add_grid_options(*app, options->grid);
  add_placement_options(*app, options->placement);
  add_printing_options(*app, options->printing);
  add_server_options(*app, common);
  app->footer(
      "Examples:\n  ccslice preview engine.ccmesh --plane z=10 --channel hardness -o cut.png\n"
      "  ccslice preview engine.ccmesh --plane 0,0,10:1,0,1 --channel hardness --colours cividis -o oblique.png\n"
      "  ccslice preview engine.ccmesh --sweep 60 --animate --channel hardness -o sweep.png");
  return {app, [options](Session& session) { run_preview(session, *options); }};
}

}  // namespace ccslice::cli
