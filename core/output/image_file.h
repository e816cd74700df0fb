// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Picture files in memory that OpenImageIO writes (image_file_oiio.cpp); a build without it has
// image_file_unavailable.cpp. PNG files are our own (png.h).
//
//   TIFF  grey, 1, 8, 16 bit or float; strips of deflate level 1; the resolution, if the pitch is known.
//   TIFF with alpha  8, 16 bit or float; each sample is followed by its alpha, which is unassociated.
//   EXR   float, any number of named channels; zip. OpenEXR keeps channels in alphabetical order.
//
// Files hold nothing but the picture: no date, host or program, so equal layers are equal files.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/plane.h"

namespace ccslice {

/// Whether this build writes them.
bool image_files_available() noexcept;

/// REQUIRES: image_files_available(), `format` is kTiff, kTiffAlpha or kExr and holds what `image` has (see
/// encoding_obstacle), at least one row and column. Throws Error{kInternal, kCancelled}.
std::vector<std::uint8_t> encode_image_file(Encoding format, const SampleImage& image, const CancellationToken& cancel);

}  // namespace ccslice
