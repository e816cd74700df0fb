// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples of a volume as numbers of C++.

#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/volume/volume.h"

namespace ccslice {

/// Sample number `index`.
template <typename Sample>
Sample load_sample(const std::byte* bytes, std::uint64_t index) noexcept {
  Sample sample;
  std::memcpy(&sample, bytes + index * sizeof(Sample), sizeof(Sample));
  return sample;
}

/// visit(Sample{}), with the type of the samples.
template <typename Visit>
void with_sample_type(VolumeSampleType type, const Visit& visit) {
  switch (type) {
    case VolumeSampleType::kUint8: return visit(std::uint8_t{});
    case VolumeSampleType::kInt16: return visit(std::int16_t{});
    case VolumeSampleType::kUint16: return visit(std::uint16_t{});
    case VolumeSampleType::kFloat32: return visit(float{});
  }
}

}  // namespace ccslice
