// SPDX-FileCopyrightText: The ccslice authors
// SPDX-License-Identifier: Apache-2.0
//
// Contone planes: one material channel, one sample a voxel.
//
//   integer sample = floor((value - min) / (max - min) * largest + 1/2), clamped to [0, largest]
//
// so halves round up, and 0 and `largest` stand for min and max. Voxels that nobody sets are spec.outside_sample, which
// is a sample and not a value.

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/base/cancellation.h"
#include "core/limit/limit_solid.h"
#include "core/output/plane.h"

namespace ccslice {

/// What an integer plane maps: spec.range, or else the channel's range.
ValueRange value_range(const PlaneSpec& spec, const ChannelRange& channel);

/// REQUIRES: value not NaN. An empty range (a constant channel) maps everything to 0.
std::uint32_t quantize(double value, const ValueRange& range, std::uint32_t largest) noexcept;

/// The samples of one channel in one layer. Memory is kept from layer to layer.
class ContonePlane {
 public:
  /// `of_solid`: the channel's number in the solid, if it is one of its own. REQUIRES: spec.content is kChannel,
  /// spec.sample_type isn't kBit.
  ContonePlane(const PlaneSpec& spec, const ChannelRange& channel, std::optional<std::uint32_t> of_solid);

  /// Room for so many samples, so that windows that grow from layer to layer need no other memory.
  void reserve(std::size_t voxels);
  /// Takes this size, with any samples. Throws Error{kCancelled}.
  void resize(std::uint32_t width, std::uint32_t height, const CancellationToken& cancel = {});
  /// The same, and all samples are as outside.
  void clear(std::uint32_t width, std::uint32_t height, const CancellationToken& cancel = {});
  /// Sets `count` samples from `index` on to what they are outside.
  void clear_run(std::size_t index, std::uint32_t count) noexcept;
  /// Sets voxel `index` (width * y + x) from the values of all of the solid's channels. Nothing if it isn't of one.
  void set(std::size_t index, std::span<const double> channel_values) noexcept;
  /// The same of `count` voxels from `index` on, `channel_count` values a voxel.
  void set_run(std::size_t index, std::uint32_t count, std::span<const double> channel_values,
               std::size_t channel_count) noexcept;
  /// Sets `count` voxels from `index` on to the values c[0] + c[1] t + c[2] t^2 + c[3] t^3 at t = t0 + k * dt, k from
  /// `first` up, clamped to the channel's range in the control mesh, which bounds its exact values. REQUIRES: count >
  /// 0.
  void set_cubic(std::size_t index, std::uint32_t first, std::uint32_t count, double t0, double dt,
                 const std::array<double, 4>& c) noexcept;
  /// Values of voxels from `index` on. REQUIRES: kFloat32.
  void read_values(std::size_t index, std::span<float> values) const noexcept;
  /// Sets voxels from `index` on to their values.
  void set_values(std::size_t index, std::span<const float> values) noexcept;
  void copy(std::size_t from_index, std::size_t to_index) noexcept;
  /// Takes `count` voxels from another plane of the same sample type.
  void copy_run(const ContonePlane& from, std::size_t from_index, std::size_t to_index, std::uint32_t count) noexcept;

  /// The channel's number in the solid, if it is one of its own.
  std::optional<std::uint32_t> channel() const noexcept { return channel_; }
  SampleImage image() const noexcept {
    return {.type = type_, .width = width_, .height = height_, .samples = samples_, .outside = outside_};
  }

 private:
  void set_value(std::size_t index, double value) noexcept;

  std::optional<std::uint32_t> channel_;
  SampleType type_;
  ValueRange range_;
  ValueRange channel_range_;
  std::array<std::uint8_t, 4> outside_{};   // The sample of voxels outside; as many bytes as it has.
  double factor_ = 0, low_ = 0, high_ = 0;  // Integer samples per unit of value, and where they are clamped.
  std::uint32_t width_ = 0;
  std::uint32_t height_ = 0;
  std::vector<std::uint8_t> samples_;
};

}  // namespace ccslice
