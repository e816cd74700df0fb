// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Samples on a regular grid, such as those of a CT scan. Immutable, and shared by all that read it.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/base/cancellation.h"

namespace ccslice {

enum class VolumeSampleType { kUint8, kInt16, kUint16, kFloat32 };

/// Bytes of a sample.
std::size_t bytes_of(VolumeSampleType type) noexcept;
/// "UINT8", ...
std::string_view name_of(VolumeSampleType type) noexcept;

struct VolumeShape {
  std::array<std::uint32_t, 3> samples{1, 1, 1};  // Along i, j and k.
  std::uint32_t channels = 1;                     // Values at each place.
  VolumeSampleType type = VolumeSampleType::kUint8;

  /// Throws Error{kVolumeInvalid} if there are no samples, or more than 64-bit numbers can count.
  std::uint64_t bytes() const;

  bool operator==(const VolumeShape&) const = default;
};

class Volume {
 public:
  /// Least and greatest sample, those that are NaN aside; both 0 if all are.
  struct ChannelSamples {
    double min = 0, max = 0;
    std::uint64_t nan = 0;
  };

  /// `bytes`: little-endian, of shape.bytes(); those of a place one after the other, places by i, then j, then k.
  /// Throws Error{kVolumeInvalid, kCancelled}: bytes of another size, infinite samples.
  Volume(const VolumeShape& shape, std::vector<std::byte> bytes, const CancellationToken& cancel = {});

  const VolumeShape& shape() const noexcept { return shape_; }
  const std::byte* bytes() const noexcept { return bytes_.data(); }
  const std::vector<ChannelSamples>& channels() const noexcept { return channels_; }
  std::uint64_t memory_bytes() const noexcept { return bytes_.size() + sizeof(Volume); }

 private:
  template <typename Sample>
  void count_samples(const CancellationToken& cancel);

  VolumeShape shape_;
  std::vector<std::byte> bytes_;
  std::vector<ChannelSamples> channels_;
};

}  // namespace ccslice
