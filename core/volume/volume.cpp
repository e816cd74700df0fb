// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/volume/volume.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>
#include <type_traits>
#include <utility>

#include "core/base/error.h"
#include "core/volume/load_sample.h"

namespace ccslice {
namespace {

constexpr std::uint32_t kMostChannels = 256;

}  // namespace

static_assert(std::endian::native == std::endian::little);

std::size_t bytes_of(VolumeSampleType type) noexcept {
  switch (type) {
    case VolumeSampleType::kUint8: return 1;
    case VolumeSampleType::kInt16:
    case VolumeSampleType::kUint16: return 2;
    case VolumeSampleType::kFloat32: break;
  }
  return 4;
}

std::string_view name_of(VolumeSampleType type) noexcept {
  switch (type) {
    case VolumeSampleType::kUint8: return "UINT8";
    case VolumeSampleType::kInt16: return "INT16";
    case VolumeSampleType::kUint16: return "UINT16";
    case VolumeSampleType::kFloat32: break;
  }
  return "FLOAT32";
}

std::uint64_t VolumeShape::bytes() const {
  if (channels == 0 || channels > kMostChannels) {
    throw Error(ErrorCode::kVolumeInvalid,
                "channels: " + std::to_string(channels) + "; a volume has 1 to " + std::to_string(kMostChannels),
                "channels");
  }
  std::uint64_t all = bytes_of(type) * channels;
  for (std::size_t axis = 0; axis < samples.size(); ++axis) {
    const std::string field = std::string("samples_") + "ijk"[axis];
    if (samples[axis] == 0) throw Error(ErrorCode::kVolumeInvalid, field + ": none; give at least one", field);
    constexpr std::uint32_t kMostAlongAxis = std::numeric_limits<std::int32_t>::max();
    if (samples[axis] > kMostAlongAxis || all > std::numeric_limits<std::int64_t>::max() / samples[axis]) {
      throw Error(ErrorCode::kVolumeInvalid, field + ": too many samples to count; give fewer", field);
    }
    all *= samples[axis];
  }
  return all;
}

Volume::Volume(const VolumeShape& shape, std::vector<std::byte> bytes, const CancellationToken& cancel)
    : shape_(shape), bytes_(std::move(bytes)) {
  if (bytes_.size() != shape_.bytes()) {
    throw Error(ErrorCode::kVolumeInvalid,
                "samples_zstd: " + std::to_string(bytes_.size()) + " bytes of samples, and the volume has " +
                    std::to_string(shape_.bytes()) + "; give all of them",
                "samples_zstd");
  }
  channels_.resize(shape_.channels);
  with_sample_type(shape_.type, [&](auto sample) { count_samples<decltype(sample)>(cancel); });
}

template <typename Sample>
void Volume::count_samples(const CancellationToken& cancel) {
  const std::uint64_t row = std::uint64_t{shape_.samples[0]} * shape_.channels;
  const std::uint64_t rows = bytes_.size() / sizeof(Sample) / row;
  struct Seen {
    Sample min = std::numeric_limits<Sample>::max(), max = std::numeric_limits<Sample>::lowest();
    std::uint64_t nan = 0;
  };
  std::vector<Seen> seen(shape_.channels);
  for (std::uint64_t r = 0; r < rows; ++r) {
    cancel.throw_if_cancelled();
    for (std::uint64_t s = 0; s < row; s += shape_.channels) {
      for (std::uint32_t c = 0; c < shape_.channels; ++c) {
        const auto sample = load_sample<Sample>(bytes_.data(), r * row + s + c);
        Seen& of = seen[c];
        if constexpr (std::is_floating_point_v<Sample>) {
          if (std::isinf(sample)) {
            throw Error(ErrorCode::kVolumeInvalid,
                        "samples_zstd: the sample at (i, j, k) = (" + std::to_string(s / shape_.channels) + ", " +
                            std::to_string(r % shape_.samples[1]) + ", " + std::to_string(r / shape_.samples[1]) +
                            ") is infinite; give NaN where there is no value",
                        "samples_zstd");
          }
          if (std::isnan(sample)) {
            ++of.nan;
            continue;
          }
        }
        of.min = std::min(of.min, sample);
        of.max = std::max(of.max, sample);
      }
    }
  }
  for (std::size_t c = 0; c < seen.size(); ++c) {
    channels_[c].nan = seen[c].nan;
    if (seen[c].min > seen[c].max) continue;  // All are NaN.
    channels_[c].min = static_cast<double>(seen[c].min);
    channels_[c].max = static_cast<double>(seen[c].max);
  }
}

}  // namespace ccslice
