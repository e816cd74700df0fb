// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "client/cli/base/console.h"
#include "client/cli/base/text_values.h"
#include "client/cli/commands/picture_options.h"
#include "client/cli/options/cut_plane.h"
#include "client/cli/options/part_box.h"
#include "client/cli/options/placement.h"
#include "client/cli/options/printing.h"
#include "client/cli/pictures/animated_png.h"
#include "client/cli/pictures/contact_sheet.h"
#include "client/cli/pictures/pixel_font.h"
#include "client/cli/pictures/png_file.h"
#include "client/preview.h"
#include "core/output/png.h"

namespace ccslice::cli {
namespace {

constexpr std::string_view kShades = ".:-=+*#%@";

v1::ColourMapName to_colour_map(const std::string& name) {
  if (name == "cividis") return v1::COLOUR_MAP_NAME_CIVIDIS;
  if (name == "grey") return v1::COLOUR_MAP_NAME_GREY;
  return v1::COLOUR_MAP_NAME_VIRIDIS;
}

void set_content(const PictureOptions& options, const v1::SliceJob& job, v1::PreviewRequest& request) {
  const std::string show = what_to_show(options, job.has_printing());
  if (!job.has_printing() && (show == "mix" || show == "halftone")) {
    throw UsageError("--show " + show +
                     " shows materials: name them, --material NAME=#RRGGBB, and how they mix, --map");
  }
  v1::PreviewContent& content = *request.mutable_content();
  if (options.lines) content.mutable_lines()->set_width_pixels(*options.lines);
  if (show == "occupancy") content.mutable_occupancy();
  if (show == "mix") content.mutable_mix();
  if (show == "halftone") {
    v1::HalftoneContent& halftone = *content.mutable_halftone();
    const GridOptions& grid = options.job.grid;
    if (!options.layer) *halftone.mutable_grid() = parse_grid(grid);
    if (!options.layer && !grid.printer.empty()) halftone.mutable_printer()->set_name(grid.printer);
  }
  if (show != "channel") return;
  if (options.channel.empty()) throw UsageError("--show channel: say which one, --channel NAME");
  content.mutable_channel()->set_channel(options.channel);
  content.mutable_channel()->set_colours(to_colour_map(options.terminal ? "grey" : options.colours));
  if (options.range.empty()) return;
  const std::vector<double> range = parse_numbers("--range", options.range, 2, 2);
  content.mutable_channel()->mutable_range()->set_min(range[0]);
  content.mutable_channel()->mutable_range()->set_max(range[1]);
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

void set_range(double min, double max, v1::PreviewRequest& request) {
  if (!(min < max)) return;
  request.mutable_content()->mutable_channel()->mutable_range()->set_min(min);
  request.mutable_content()->mutable_channel()->mutable_range()->set_max(max);
}

/// The range of all pictures of a sweep is one, or colours would change their meaning from one to the next: that of the
/// mesh's channel, or what small pictures show of a field.
void fix_range(Session& session, const PictureOptions& options, const std::vector<CutPlane>& planes,
               const v1::Box3& box, v1::PreviewRequest& request) {
  if (!request.content().has_channel() || request.content().channel().has_range()) return;
  const v1::MeshSummary mesh = session.client().mesh_summary(request.mesh_id(), session.call());
  for (const v1::Channel& channel : mesh.channels()) {
    if (channel.name() == options.channel) return set_range(channel.min_value(), channel.max_value(), request);
  }
  constexpr std::uint32_t kPixels = 64;
  std::vector<FramedCut> small;
  for (const CutPlane& plane : planes) small.push_back(frame_cut(plane, box, kPixels));
  double min = std::numeric_limits<double>::infinity(), max = -min;
  for_planes(session, request, small, [&](std::size_t, const client::PreviewPicture& picture) {
    if (!picture.header.has_range()) return;
    min = std::min(min, picture.header.range().min());
    max = std::max(max, picture.header.range().max());
  });
  set_range(min, max, request);
}

std::string sweep_of(Session& session, const PictureOptions& options, v1::PreviewRequest request, const v1::Box3& box) {
  const CutPlane plane = parse_cut_plane(options.plane.empty() ? "z=0" : options.plane);
  const int count = static_cast<int>(options.sweep);
  const FramedCut whole = frame_cut(plane, box, options.pixels());
  const SheetLayout layout = lay_out_sheet(count, whole.width, whole.height);
  const auto longer = static_cast<std::uint32_t>(std::max(layout.tile_width, layout.tile_height));
  const std::uint32_t pixels = options.animate ? options.pixels() : std::clamp(longer, 16u, kMostPicturePixels);
  std::vector<CutPlane> cuts;
  std::vector<FramedCut> planes;
  for (int i = 0; i < count; ++i) {
    cuts.push_back(moved_to(plane, box, (i + 0.5) / count));
    planes.push_back(frame_cut(cuts.back(), box, pixels));
  }
  request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
  fix_range(session, options, cuts, box, request);
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
    draw_text(show_number(height_of(cuts[i])) + " mm", left, top + height + 4, sheet, 1);
  });
  return to_png(sheet);
}

/// Brighter pixels are denser characters, which are twice as high as wide. Of pictures that are wider than `most` only
/// some pixels are drawn.
DrawnPicture characters_of(const client::PreviewPicture& picture, std::uint32_t most) {
  const std::uint32_t width = picture.header.width(), height = picture.header.height();
  const std::uint32_t across = (width + most - 1) / most;
  const double up_per_across = picture.header.up_mm_per_pixel() / picture.header.across_mm_per_pixel();
  const auto up = static_cast<std::uint32_t>(std::max(1.0, std::round(2 * across / up_per_across)));
  const auto* rgba = reinterpret_cast<const std::uint8_t*>(picture.bytes.data());
  std::string text;
  for (std::uint32_t y = std::min(up / 2, height - 1); y < height; y += up) {
    std::string line;
    for (std::uint32_t x = across / 2; x < width; x += across) {
      const std::uint8_t* const pixel = rgba + 4 * (std::size_t{y} * width + x);
      const std::size_t brightness = (2u * pixel[0] + 5u * pixel[1] + pixel[2]) / 8;
      line += pixel[3] == 0 ? ' ' : kShades[brightness * kShades.size() / 256];
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return {text, width, height, picture.header, across * picture.header.across_mm_per_pixel()};
}

/// One for each character.
void ask_for_characters(v1::PreviewRequest& request) {
  v1::FreePlane& plane = *request.mutable_plane()->mutable_free();
  plane.set_up_mm_per_pixel(2 * plane.across_mm_per_pixel());
  request.set_height((request.height() + 1) / 2);
}

/// The plane of --plane, or one half-way up if only --terminal is given.
CutPlane plane_to_draw(const PictureOptions& options, const v1::Box3& box) {
  if (!options.plane.empty()) return parse_cut_plane(options.plane);
  return moved_to(parse_cut_plane("z=0"), box, 0.5);
}

DrawnPicture draw_plane(Session& session, const PictureOptions& options, v1::PreviewRequest request) {
  if (!options.layer) {
    const v1::Box3 box = part_box(session, request.mesh_id(), request.placement());
    set_plane(frame_cut(plane_to_draw(options, box), box, options.pixels()), request);
    if (options.terminal) ask_for_characters(request);
  }
  if (options.terminal) request.set_encoding(v1::PREVIEW_ENCODING_RGBA);
  client::PreviewPicture picture = session.client().preview(request, session.call());
  if (options.terminal) return characters_of(picture, options.pixels());
  return {std::move(picture.bytes), picture.header.width(), picture.header.height(), picture.header};
}

std::vector<std::string> names_of(const v1::Printing& printing) {
  std::vector<std::string> names;
  for (const v1::PrintMaterial& material : printing.materials()) names.push_back(material.name());
  return names;
}

}  // namespace

std::string what_to_show(const PictureOptions& options, bool has_materials) {
  if (!options.show.empty()) return options.show;
  if (options.cell_regions) return "cell regions";
  if (!options.channel.empty()) return "channel";
  if (!has_materials) return "occupancy";
  return options.layer || options.in_space() ? "halftone" : "mix";
}

v1::SliceJob job_to_draw(const PictureOptions& options) {
  if (options.layer) return job_of(options.job, {});
  if (options.job.mesh.mesh.empty()) throw UsageError("say what to draw: MESH, or --layer of a file with --job");
  v1::SliceJob job = client::job_of("", parse_placement(options.job.placement));
  add_fields(options.job, job);
  if (const auto printing = parse_printing(options.job.printing)) *job.mutable_printing() = *printing;
  return job;
}

v1::PreviewRequest request_of(const PictureOptions& options, const v1::SliceJob& job) {
  v1::PreviewRequest request;
  set_content(options, job, request);
  if (options.layer) {
    v1::PreviewLayer& layer = *request.mutable_plane()->mutable_layer();
    layer.set_layer(*options.layer);
    *layer.mutable_job() = job;
    return request;
  }
  if (!options.plane.empty()) parse_cut_plane(options.plane);
  request.set_mesh_id(job.parts(0).mesh_id());
  *request.mutable_placement() = job.parts(0).placements(0);
  if (job.has_printing()) *request.mutable_printing() = job.printing();
  *request.mutable_fields() = job.fields();
  request.set_cut(job.cut());
  return request;
}

DrawnPicture draw_planes(Session& session, const PictureOptions& options, const v1::SliceJob& job) {
  const v1::PreviewRequest request = request_of(options, job);
  if (options.sweep > 0) {
    return {sweep_of(session, options, request, part_box(session, request.mesh_id(), request.placement()))};
  }
  DrawnPicture drawn = draw_plane(session, options, request);
  drawn.materials = names_of(job.printing());
  return drawn;
}

}  // namespace ccslice::cli
