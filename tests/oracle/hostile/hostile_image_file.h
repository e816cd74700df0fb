// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// TIFF and EXR files of hostile jobs, by OpenImageIO where it is built in.

#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/job/grid.h"
#include "core/output/plane.h"

namespace ccslice::oracle {

struct ImageFile {
  std::vector<std::uint8_t> samples;  // As Encoding::kRaw has them.
  std::vector<std::uint8_t> alpha;    // A byte a voxel, if there is alpha: 1 inside.
};

/// `names`: of the plane's channels, by which EXR has them in any order. Throws std::runtime_error for files that
/// aren't what `plane` asks for.
ImageFile read_image_file(std::span<const std::uint8_t> file, const PlaneSpec& plane,
                          std::span<const std::string> names, const GridExtent& extent);

}  // namespace ccslice::oracle
