// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Picture files in memory. image_file_oiio.cpp writes them through OpenImageIO; a build without it has
// image_file_unavailable.cpp.
//
//   PNG   grey, 8 or 16 bit; deflate level 1 without row filters (adaptive filters cost more than the deflate).
//   TIFF  grey, 1, 8, 16 bit or float; strips of deflate level 1.
//   EXR   float, any number of named channels; zip. OpenEXR keeps channels in alphabetical order.
//
// Files hold nothing but the picture: no date, host or program, so equal layers are equal files.

#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/output/plane.h"

namespace ccslice {

/// Whether this build writes picture files at all.
bool image_files_available() noexcept;

/// REQUIRES: image_files_available(), `format` is kPng, kTiff or kExr and holds what `image` has (see
/// encoding_obstacle), at least one row and column. Throws Error{kInternal, kCancelled}.
std::vector<std::uint8_t> encode_image_file(Encoding format, const SampleImage& image, const CancellationToken& cancel);

}  // namespace ccslice
