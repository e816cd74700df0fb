// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Outlines drawn on top of pictures. Of a pixel whose middle is d pixels from a line of the width w, the line covers
// w / 2 + 1/2 - d, at most w and at most 1: as much as of a strip along it, a pixel wide. Of several lines the one that
// covers most counts, so joints and crossings are no darker than the lines. Where colours mustn't mix, pixels within
// w / 2, and at least 1/2, are the line's, and others aren't.

#pragma once

#include "core/base/cancellation.h"
#include "core/preview/preview_job.h"

namespace ccslice {

/// Draws the picture's outlines as show.lines says, in pixels `times` as wide as those of the full picture. Beside the
/// part a line makes pixels as opaque as they are covered. Halftones get no colours in between. REQUIRES: show.lines, a
/// picture whose pixels are set, outlines of finite points. Throws Error{kCancelled}.
void draw_lines(const PreviewColours& show, double times, PreviewPicture& picture, const CancellationToken& cancel);

}  // namespace ccslice
