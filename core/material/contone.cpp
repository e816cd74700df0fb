// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/material/contone.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace ccslice {
namespace {

constexpr std::size_t kPieceBytes = 16 << 20;  // Cancellation is polled once a piece: some milliseconds of fresh pages.

std::size_t bytes_per_sample(SampleType type) noexcept {
  return type == SampleType::kUint8 ? 1 : type == SampleType::kUint16 ? 2 : 4;
}

}  // namespace

ValueRange value_range(const PlaneSpec& spec, const ChannelRange& channel) {
  return spec.range.value_or(ValueRange{channel.min, channel.max});
}

std::uint32_t quantize(double value, const ValueRange& range, std::uint32_t largest) noexcept {
  if (!(range.max > range.min)) return 0;
  const double sample = std::floor((value - range.min) / (range.max - range.min) * largest + 0.5);
  if (!(sample > 0)) return 0;
  return sample < largest ? static_cast<std::uint32_t>(sample) : largest;
}

ContonePlane::ContonePlane(const PlaneSpec& spec, const ChannelRange& channel)
    : channel_(spec.channel), type_(spec.sample_type), range_(value_range(spec, channel)) {}

void ContonePlane::clear(std::uint32_t width, std::uint32_t height, const CancellationToken& cancel) {
  width_ = width;
  height_ = height;
  const std::size_t size = sample_bytes(type_, width, height);
  samples_.clear();
  samples_.reserve(size);
  while (samples_.size() < size) {
    cancel.throw_if_cancelled();
    samples_.resize(std::min(size, samples_.size() + kPieceBytes));
  }
}

void ContonePlane::set(std::size_t index, std::span<const double> channel_values) noexcept {
  const double value = channel_values[channel_];
  if (type_ == SampleType::kUint8) {
    samples_[index] = static_cast<std::uint8_t>(quantize(value, range_, 255));
  } else if (type_ == SampleType::kUint16) {
    const auto sample = static_cast<std::uint16_t>(quantize(value, range_, 65535));
    std::memcpy(&samples_[2 * index], &sample, sizeof sample);
  } else {
    const auto sample = static_cast<float>(value);
    std::memcpy(&samples_[4 * index], &sample, sizeof sample);
  }
}

void ContonePlane::copy(std::size_t from_index, std::size_t to_index) noexcept {
  const std::size_t size = bytes_per_sample(type_);
  std::memcpy(&samples_[size * to_index], &samples_[size * from_index], size);
}

}  // namespace ccslice
