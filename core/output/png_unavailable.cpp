// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/error.h"
#include "core/output/png.h"

namespace ccslice {

bool png_available() noexcept { return false; }

std::vector<std::uint8_t> encode_grey_png(std::uint32_t, std::uint32_t, int, std::span<const std::uint8_t>,
                                          const CancellationToken&) {
  throw Error(ErrorCode::kInternal, "PNG asked of a build without OpenImageIO");
}

}  // namespace ccslice
