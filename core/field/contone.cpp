// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0

#include "core/field/contone.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "core/output/arrange.h"

namespace ccslice {
namespace {

// Coefficients of bytes that single precision will do for, in all: it is off by a thousandth of a step at most.
constexpr double kMostOfSingle = 1024;
constexpr std::size_t kPieceBytes = 16 << 20;  // Cancellation is polled once a piece: some milliseconds of fresh pages.

std::size_t bytes_per_sample(SampleType type) noexcept {
  return type == SampleType::kUint8 ? 1 : type == SampleType::kUint16 ? 2 : 4;
}

std::array<std::uint8_t, 4> bytes_of(double sample, SampleType type) noexcept {
  std::array<std::uint8_t, 4> bytes{};
  if (type == SampleType::kFloat32) {
    const auto number = static_cast<float>(sample);
    std::memcpy(bytes.data(), &number, sizeof number);
  } else {
    const auto number = static_cast<std::uint16_t>(sample);
    std::memcpy(bytes.data(), &number, bytes_per_sample(type));
  }
  return bytes;
}

/// Values c[0] + c[1] t + c[2] t^2 + c[3] t^3 at t = t0 + k * dt, k >= first, clamped to [low, high].
struct CubicRow {
  std::uint32_t first;
  double t0, dt;
  std::array<double, 4> c;
  double low, high;
};

template <typename Sample, std::uint32_t kCount>
void copy_samples(const Sample* from, std::uint8_t* to) noexcept {
  std::memcpy(to, from, kCount * sizeof(Sample));  // A fixed size compiles to a few instructions without a call.
}

/// `count` of the samples. REQUIRES: 0 < count <= 2 * kMost.
template <typename Sample, std::uint32_t kMost>
void copy_first(const std::array<Sample, 2 * kMost>& from, std::uint32_t count, std::uint8_t* to) noexcept {
  if (count >= kMost) {
    copy_samples<Sample, kMost>(from.data(), to);
    copy_samples<Sample, kMost>(&from[count - kMost], to + (count - kMost) * sizeof(Sample));
  } else if constexpr (kMost > 1) {
    std::array<Sample, kMost> first;
    std::copy_n(from.begin(), kMost, first.begin());
    copy_first<Sample, kMost / 2>(first, count, to);
  }
}

/// Integer samples are truncated. In blocks, so that the compiler sees plain loops over locals and vectorizes them; the
/// last block ends where the row does, and writes what the one before wrote once more.
template <typename Sample, typename Real, std::uint32_t kBlock>
void write_blocks(const CubicRow& row, std::uint32_t count, std::uint8_t* out) noexcept {
  const auto t0 = static_cast<Real>(row.t0), dt = static_cast<Real>(row.dt);
  const auto c0 = static_cast<Real>(row.c[0]), c1 = static_cast<Real>(row.c[1]);
  const auto c2 = static_cast<Real>(row.c[2]), c3 = static_cast<Real>(row.c[3]);
  const auto low = static_cast<Real>(row.low), high = static_cast<Real>(row.high);
  using Wide = std::conditional_t<std::is_integral_v<Sample>, std::int32_t, Sample>;
  std::array<Sample, kBlock> block;
  const auto fill_from = [&](std::uint32_t begin) {
    for (std::uint32_t k = 0; k < kBlock; ++k) {
      const Real t = t0 + dt * static_cast<Real>(static_cast<std::int32_t>(row.first + begin + k));
      const Real value = ((c3 * t + c2) * t + c1) * t + c0;
      block[k] = static_cast<Sample>(static_cast<Wide>(std::min(std::max(value, low), high)));
    }
  };
  if (count < kBlock) {
    fill_from(0);
    return copy_first<Sample, kBlock / 2>(block, count, out);
  }
  for (std::uint32_t begin = 0; begin < count; begin += kBlock) {
    const std::uint32_t at = std::min(begin, count - kBlock);
    fill_from(at);
    copy_samples<Sample, kBlock>(block.data(), out + std::size_t{at} * sizeof(Sample));
  }
}

/// REQUIRES: count > 0.
template <typename Sample, typename Real>
void write_cubic(const CubicRow& row, std::uint32_t count, std::uint8_t* out) noexcept {
  constexpr std::uint32_t kShort = 16, kLong = 64;
  count < 2 * kLong ? write_blocks<Sample, Real, kShort>(row, count, out)
                    : write_blocks<Sample, Real, kLong>(row, count, out);
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

ContonePlane::ContonePlane(const PlaneSpec& spec, const ChannelRange& channel, std::optional<std::uint32_t> of_solid)
    : channel_(of_solid),
      type_(spec.sample_type),
      range_(value_range(spec, channel)),
      channel_range_{channel.min, channel.max},
      outside_(bytes_of(spec.outside_sample, spec.sample_type)) {
  if (type_ == SampleType::kFloat32) return;
  const std::uint32_t largest = type_ == SampleType::kUint8 ? 255 : 65535;
  factor_ = range_.max > range_.min ? largest / (range_.max - range_.min) : 0;
  low_ = quantize(channel.min, range_, largest);
  high_ = quantize(channel.max, range_, largest) + 0.5;
}

void ContonePlane::reserve(std::size_t voxels) { samples_.reserve(bytes_per_sample(type_) * voxels); }

void ContonePlane::resize(std::uint32_t width, std::uint32_t height, const CancellationToken& cancel) {
  width_ = width;
  height_ = height;
  const std::size_t size = sample_bytes(type_, width, height);
  samples_.reserve(size);
  if (samples_.size() > size) samples_.resize(size);
  while (samples_.size() < size) {
    cancel.throw_if_cancelled();
    samples_.resize(std::min(size, samples_.size() + kPieceBytes));
  }
}

void ContonePlane::clear(std::uint32_t width, std::uint32_t height, const CancellationToken& cancel) {
  resize(width, height, cancel);
  const auto outside = std::span(outside_).first(bytes_per_sample(type_));
  for (std::size_t begin = 0; begin < samples_.size(); begin += kPieceBytes) {
    cancel.throw_if_cancelled();
    fill_samples(std::span(samples_).subspan(begin, std::min(kPieceBytes, samples_.size() - begin)), outside);
  }
}

void ContonePlane::clear_run(std::size_t index, std::uint32_t count) noexcept {
  const std::size_t size = bytes_per_sample(type_);
  fill_samples(std::span(samples_).subspan(size * index, size * count), std::span(outside_).first(size));
}

void ContonePlane::set(std::size_t index, std::span<const double> channel_values) noexcept {
  if (channel_) set_value(index, channel_values[*channel_]);
}

void ContonePlane::read_values(std::size_t index, std::span<float> values) const noexcept {
  std::memcpy(values.data(), &samples_[sizeof(float) * index], values.size_bytes());
}

void ContonePlane::set_values(std::size_t index, std::span<const float> values) noexcept {
  if (type_ == SampleType::kFloat32) {
    std::memcpy(&samples_[sizeof(float) * index], values.data(), values.size_bytes());
    return;
  }
  for (std::size_t k = 0; k < values.size(); ++k) set_value(index + k, values[k]);
}

void ContonePlane::set_value(std::size_t index, double value) noexcept {
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

void ContonePlane::set_run(std::size_t index, std::uint32_t count, std::span<const double> channel_values,
                           std::size_t channel_count) noexcept {
  for (std::uint32_t k = 0; k < count; ++k) set(index + k, channel_values.subspan(k * channel_count, channel_count));
}

void ContonePlane::set_cubic(std::size_t index, std::uint32_t first, std::uint32_t count, double t0, double dt,
                             const std::array<double, 4>& c) noexcept {
  const ValueRange& channel = channel_range_;
  if (type_ == SampleType::kFloat32) {
    return write_cubic<float, double>({first, t0, dt, c, channel.min, channel.max}, count, &samples_[4 * index]);
  }
  const CubicRow row{first, t0,
                     dt,    {(c[0] - range_.min) * factor_ + 0.5, c[1] * factor_, c[2] * factor_, c[3] * factor_},
                     low_,  high_};
  if (type_ == SampleType::kUint8) {
    // They are large where the plane shows but a little of what the channel does along the row.
    const double all = std::abs(row.c[0]) + std::abs(row.c[1]) + std::abs(row.c[2]) + std::abs(row.c[3]);
    return all <= kMostOfSingle ? write_cubic<std::uint8_t, float>(row, count, &samples_[index])
                                : write_cubic<std::uint8_t, double>(row, count, &samples_[index]);
  }
  write_cubic<std::uint16_t, double>(row, count, &samples_[2 * index]);
}

void ContonePlane::copy_run(const ContonePlane& from, std::size_t from_index, std::size_t to_index,
                            std::uint32_t count) noexcept {
  const std::size_t size = bytes_per_sample(type_);
  std::memcpy(&samples_[size * to_index], &from.samples_[size * from_index], size * count);
}

void ContonePlane::copy(std::size_t from_index, std::size_t to_index) noexcept {
  copy_run(*this, from_index, to_index, 1);
}

}  // namespace ccslice
