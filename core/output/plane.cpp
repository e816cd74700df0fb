// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/output/plane.h"

#include <string>

#include "core/base/error.h"

namespace ccslice {

std::uint64_t sample_bytes(SampleType type, std::uint32_t width, std::uint32_t height, std::uint32_t channels) {
  const std::uint64_t samples = std::uint64_t{width} * height * channels;
  switch (type) {
    case SampleType::kBit: return (std::uint64_t{width} + 7) / 8 * height * channels;
    case SampleType::kUint8: return samples;
    case SampleType::kUint16: return 2 * samples;
    case SampleType::kFloat32: return 4 * samples;
    case SampleType::kUint2: return (std::uint64_t{width} + 3) / 4 * height * channels;
    case SampleType::kUint4: return (std::uint64_t{width} + 1) / 2 * height * channels;
  }
  throw Error(ErrorCode::kInternal, "unknown sample type " + std::to_string(static_cast<int>(type)));
}

std::uint64_t sample_bytes(const PlaneSpec& plane, const LayerWindow& window) {
  return sample_bytes(plane.sample_type, window.columns, window.rows, channel_count(plane));
}

}  // namespace ccslice
