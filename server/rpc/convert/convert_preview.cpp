// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "server/rpc/convert/convert_preview.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/base/choice_text.h"
#include "core/base/colour_map.h"
#include "core/base/error.h"
#include "core/job/validate_job.h"
#include "core/limit/support.h"
#include "core/preview/layer_painter.h"
#include "server/rpc/convert/contract_value.h"
#include "server/rpc/convert/convert.h"
#include "server/rpc/convert/convert_fields.h"
#include "server/rpc/convert/job_field.h"
#include "server/rpc/convert/job_parts.h"
#include "server/rpc/convert/printer.h"
#include "server/service/base/service_error.h"

namespace ccslice::server {
namespace {

constexpr std::string_view kColourMapPrefix = "COLOUR_MAP_NAME_";
constexpr int kLegendColours = 32;
constexpr std::size_t kMostPartBytes = 256 << 10;  // A slow line brings it before its call sheds.

ColourMapName to_colour_map(v1::ColourMapName name) {
  if (name == v1::COLOUR_MAP_NAME_UNSPECIFIED) return PreviewColours().colours;
  if (const auto* traits = find_contract_row(kColourMaps, kColourMapPrefix, name)) return traits->map;
  throw Error(ErrorCode::kEnumValueUnknown,
              "content.channel.colours: " + std::to_string(static_cast<int>(name)) +
                  " isn't a colour map that this server knows; ask for " + choice_text(kColourMaps),
              "content.channel.colours");
}

PreviewLines to_lines(const v1::PreviewLines& message) {
  PreviewLines lines;
  if (message.width_pixels() != 0) lines.width_pixels = message.width_pixels();
  lines.colour = {static_cast<std::uint8_t>(message.rgba() >> 24), static_cast<std::uint8_t>(message.rgba() >> 16),
                  static_cast<std::uint8_t>(message.rgba() >> 8)};
  return lines;
}

PreviewColours to_colours(const v1::PreviewContent& message, const std::shared_ptr<const Printing>& printing) {
  PreviewColours show;
  show.printing = printing;
  switch (message.content_case()) {
    case v1::PreviewContent::kOccupancy: break;
    case v1::PreviewContent::kChannel:
      show.content = PreviewContent::kChannel;
      show.channel = message.channel().channel();
      show.colours = to_colour_map(message.channel().colours());
      if (message.channel().has_range()) {
        show.range = ValueRange{.min = message.channel().range().min(), .max = message.channel().range().max()};
      }
      break;
    case v1::PreviewContent::kMix: show.content = PreviewContent::kMix; break;
    case v1::PreviewContent::kHalftone: show.content = PreviewContent::kHalftone; break;
    default:
      throw Error(ErrorCode::kContentInvalid,
                  "content: nothing that this server knows; ask for occupancy, channel, mix or halftone", "content");
  }
  if (message.has_lines()) show.lines = to_lines(message.lines());
  return show;
}

[[noreturn]] void malformed(const std::string& message, const std::string& field) {
  throw ServiceError(ServiceErrorCode::kRequestMalformed, field + ": " + message, field);
}

PreviewJob to_plane_job(const v1::PreviewRequest& request, const PreviewSetting& setting,
                        const std::shared_ptr<const LimitSolid>& shared_solid, const SliceLimits& limits,
                        const CancellationToken& cancel, const Volumes& volumes) {
  const LimitSolid& solid = *shared_solid;
  const v1::FreePlane& plane = request.plane().free();
  PreviewJob job;
  job.placement = setting.placement;
  job.plane.middle_mm = to_vec3(plane.middle_mm());
  job.plane.across = to_vec3(plane.across());
  job.plane.up = to_vec3(plane.up());
  job.plane.across_mm = plane.across_mm_per_pixel();
  job.plane.up_mm = plane.up_mm_per_pixel() == 0 ? plane.across_mm_per_pixel() : plane.up_mm_per_pixel();
  job.plane.columns = request.width();
  job.plane.rows = request.height();
  job.sources = to_sources(request.fields(), volumes, shared_solid, setting.placement.linear(),
                           solid.summary().bounding_box.transformed(Placement(setting.placement)));
  if (!request.cut().empty()) job.cut = request.cut();
  job.show = to_colours(request.content(), setting.printing);
  job.contours = request.contours();
  validate_preview(solid.summary(), job, limits);
  if (job.show.content == PreviewContent::kHalftone) {
    job.voxels = at_job("content.halftone", [&] {
      return to_grid(request.content().halftone(), bounding_box(solid, setting.placement, cancel), limits);
    });
  }
  return job;
}

/// The parts but for what their pictures would be: contours stand in for them.
PlacedParts to_parts_of_layer(const v1::PreviewLayer& plane, std::span<const std::shared_ptr<const LimitSolid>> solids,
                              const SliceLimits& limits, const CancellationToken& cancel, const Volumes& volumes) {
  v1::SliceJob job = plane.job();
  job.clear_planes();
  job.clear_layout();
  job.mutable_contours()->clear_by_cell_region();
  return to_placed_parts(job, kLayerJobPath, solids, limits, cancel, nullptr, volumes);
}

void validate_layer(std::uint32_t layer, const SliceJob& job) {
  const LayerWindow window = region_of(job).window();
  if (window.columns > kMaxPreviewPixels || window.rows > kMaxPreviewPixels) {
    throw Error(ErrorCode::kPictureTooLarge,
                "plane.layer: a picture of " + std::to_string(window.columns) + " x " + std::to_string(window.rows) +
                    " voxels, and there may be " + std::to_string(kMaxPreviewPixels) +
                    " each way; give a region, or ask SliceRange for it",
                "plane.layer");
  }
  if (layer < job.grid.extent.layers) return;
  throw Error(ErrorCode::kLayerRangeOutOfBounds,
              "plane.layer.layer: there is no layer " + std::to_string(layer) + "; the grid has " +
                  std::to_string(job.grid.extent.layers),
              "plane.layer.layer");
}

LayerPreview to_layer(const v1::PreviewRequest& request, std::span<const std::shared_ptr<const LimitSolid>> solids,
                      const SliceLimits& limits, const CancellationToken& cancel, const Volumes& volumes) {
  const v1::PreviewLayer& plane = request.plane().layer();
  if (request.width() != 0 || request.height() != 0) {
    malformed("a layer is as wide and high as its region: leave width and height out", "width");
  }
  if (!request.fields().empty() || !request.cut().empty()) {
    malformed("a layer has the fields and the cut of its job: leave fields and cut out", "fields");
  }
  LayerPreview preview{to_parts_of_layer(plane, solids, limits, cancel, volumes), {}, plane.layer()};
  PlacedParts& parts = preview.parts;
  validate_layer(plane.layer(), parts.front().job);
  const auto show_of = [&](const PlacedPart& part) {
    const std::optional<Printing>& printing = part.job.printing;
    return to_colours(request.content(), printing ? std::make_shared<const Printing>(*printing) : nullptr);
  };
  preview.show = show_of(parts.front());
  auto part = parts.begin();
  check_parts(plane.job(), [&](int) {
    const PlacedPart& here = *part;
    part = std::find_if(part + 1, parts.end(), [](const PlacedPart& next) { return !next.is_copy; });
    at_job(kLayerJobPath, [&] { validate_colours(here.solid->summary(), show_of(here), here.job.sources); });
  });
  for (PlacedPart& each : parts) {
    cancel.throw_if_cancelled();
    SliceJob& job = each.job;
    if (job.region) {  // Its layers don't matter.
      job.region->first_layer = preview.layer;
      job.region->extent.layers = 1;
    }
    job = layer_preview_job(std::move(job), preview.show, request.contours());
    if (!each.is_copy) at_job(kLayerJobPath, [&] { validate_job(*each.solid, job, limits); });
  }
  return preview;
}

}  // namespace

PreviewWork to_preview(const v1::PreviewRequest& request, const PreviewSetting& setting,
                       std::span<const std::shared_ptr<const LimitSolid>> solids, const SliceLimits& limits,
                       const CancellationToken& cancel, const Volumes& volumes) {
  switch (request.plane().plane_case()) {
    case v1::PreviewPlane::kFree: return to_plane_job(request, setting, solids.front(), limits, cancel, volumes);
    case v1::PreviewPlane::kLayer: return to_layer(request, solids, limits, cancel, volumes);
    default: malformed("neither free nor layer: say which plane", "plane");
  }
}

v1::PreviewHeader to_header(const PreviewPicture& picture, const PreviewColours& show) {
  v1::PreviewHeader header;
  header.set_width(picture.columns);
  header.set_height(picture.rows);
  header.set_across_mm_per_pixel(picture.across_mm);
  header.set_up_mm_per_pixel(picture.up_mm);
  header.set_pixels_inside(picture.pixels_inside);
  if (picture.range) {
    header.mutable_range()->set_min(picture.range->min);
    header.mutable_range()->set_max(picture.range->max);
  }
  if (show.content == PreviewContent::kChannel) {
    for (int i = 0; i < kLegendColours; ++i) {
      const Srgb colour = map_colour(show.colours, static_cast<double>(i) / (kLegendColours - 1));
      header.add_colours(std::uint32_t{colour[0]} << 24 | std::uint32_t{colour[1]} << 16 |
                         std::uint32_t{colour[2]} << 8 | 0xff);
    }
  }
  for (const std::uint64_t pixels : picture.value_pixels) header.add_value_pixels(pixels);
  for (const std::uint64_t pixels : picture.material_pixels) header.add_material_pixels(pixels);
  return header;
}

std::vector<v1::PreviewResponse> to_parts(v1::PreviewHeader header, std::span<const std::uint8_t> picture) {
  std::vector<v1::PreviewResponse> parts(1);
  header.set_picture_bytes(picture.size());
  *parts.front().mutable_header() = std::move(header);
  for (std::size_t at = 0; at < picture.size(); at += kMostPartBytes) {
    v1::PreviewResponse& part = at == 0 ? parts.front() : parts.emplace_back();
    const auto chunk = picture.subspan(at, std::min(kMostPartBytes, picture.size() - at));
    part.set_picture(chunk.data(), chunk.size());
  }
  return parts;
}

void add_outlines(std::span<const std::vector<Vec2>> outlines, std::vector<v1::PreviewResponse>& parts) {
  std::size_t bytes = kMostPartBytes;  // Of a part of their own.
  for (const std::vector<Vec2>& outline : outlines) {
    const std::size_t size = sizeof(Vec2) * outline.size();
    if (bytes + size > kMostPartBytes) {
      parts.emplace_back();
      bytes = 0;
    }
    bytes += size;
    auto& points = *parts.back().add_outlines()->mutable_points_mm();
    for (const Vec2& point : outline) points.Add(point.begin(), point.end());
  }
}

}  // namespace ccslice::server
