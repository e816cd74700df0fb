// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/preview/preview_job.h"

#include <cmath>
#include <string>

#include "core/base/error.h"
#include "core/base/number_text.h"
#include "core/channel/channel_table.h"
#include "core/job/validate_placement.h"

namespace ccslice {
namespace {

void validate_channel(const ChannelTable& channels, const PreviewColours& show) {
  channels.require(show.channel, "content.channel.channel");
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

void validate_colours(const SolidSummary& summary, const PreviewColours& show, const ChannelSources& sources) {
  if (show.content == PreviewContent::kChannel) validate_channel(ChannelTable(summary.channels, sources), show);
  if (show.lines) validate_lines(*show.lines);
  if (!shows_printing(show)) return;
  if (!show.printing) {
    throw Error(ErrorCode::kMaterialsMissing, "printing: the picture shows materials; say what is printed", "printing");
  }
  validate_printing(*show.printing, summary, sources);
}

void validate_preview(const SolidSummary& summary, const PreviewJob& job, const SliceLimits& limits) {
  validate_placement(job.placement, summary.bounding_box, limits);
  validate_plane(job.plane, limits);
  const ChannelTable channels(summary.channels, job.sources);
  channels.validate_sources();
  if (job.cut) channels.require(*job.cut, "cut");
  validate_colours(summary, job.show, job.sources);
  if (!shows_printing(job.show)) return;
  if (job.show.content == PreviewContent::kHalftone && job.show.printing->halftone.traits().carries_errors) {
    throw Error(ErrorCode::kContentInvalid,
                "content.halftone: error diffusion makes a voxel depend on all before it in its layer, so it shows in "
                "pictures of layers only; show a layer, the mix, or another method",
                "content.halftone");
  }
}

}  // namespace ccslice
