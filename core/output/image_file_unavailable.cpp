// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/base/error.h"
#include "core/output/image_file.h"

namespace ccslice {

bool image_files_available() noexcept { return false; }

std::vector<std::uint8_t> encode_image_file(Encoding, const SampleImage&, const CancellationToken&) {
  throw Error(ErrorCode::kInternal, "a picture file asked of a build without OpenImageIO");
}

}  // namespace ccslice
