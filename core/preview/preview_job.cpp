// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/preview_job.h"

#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/job/validate_placement.h"

namespace ccslice {
namespace {

void validate_channel(const SolidSummary& summary, const PreviewColours& show) {
  if (show.channel >= summary.channels.size()) {
    throw Error(ErrorCode::kChannelUnknown,
                "content.channel: there is no channel " + std::to_string(show.channel) + "; the mesh has " +
                    std::to_string(summary.channels.size()),
                "content.channel");
  }
  if (!show.range) return;
  if (std::isfinite(show.range->min) && std::isfinite(show.range->max) && show.range->min < show.range->max) return;
  throw Error(ErrorCode::kValueRangeInvalid,
              "content.channel.range: from " + number_text(show.range->min) + " to " + number_text(show.range->max) +
                  "; give two finite numbers, the lower one first, or leave it out for that of the picture",
              "content.channel.range");
}

void validate_lines(const PreviewLines& lines) {
  if (lines.width_pixels >= kMinLineWidthPixels && lines.width_pixels <= kMaxLineWidthPixels) return;  // False for NaN.
  throw Error(ErrorCode::kContentInvalid,
              "content.lines.width_pixels: a line of " + number_text(lines.width_pixels) + " pixels; give " +
                  number_text(kMinLineWidthPixels) + " to " + number_text(kMaxLineWidthPixels),
              "content.lines.width_pixels");
}

bool shows_printing(const PreviewColours& show) {
  return show.content == PreviewContent::kMix || show.content == PreviewContent::kHalftone;
}

}  // namespace

void validate_colours(const SolidSummary& summary, const PreviewColours& show) {
  if (show.content == PreviewContent::kChannel) validate_channel(summary, show);
  if (show.lines) validate_lines(*show.lines);
  if (!shows_printing(show)) return;
  if (!show.printing) {
    throw Error(ErrorCode::kMaterialsMissing, "printing: the picture shows materials; say what is printed", "printing");
  }
  validate_printing(*show.printing, summary);
}

void validate_preview(const SolidSummary& summary, const PreviewJob& job, const SliceLimits& limits) {
  validate_placement(job.placement, summary.bounding_box, limits);
  validate_plane(job.plane, limits);
  validate_colours(summary, job.show);
  if (!shows_printing(job.show)) return;
  if (job.show.content == PreviewContent::kHalftone && job.show.printing->halftone.traits().carries_errors) {
    throw Error(ErrorCode::kContentInvalid,
                "content.halftone: error diffusion makes a voxel depend on all before it in its layer, so it shows in "
                "pictures of layers only; show a layer, the mix, or another method",
                "content.halftone");
  }
}

}  // namespace ccslice
